"""`train` of the model `explicit`: radius maps, texel grids (docs/reference/method.md). Preset `fast`: the defaults."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Length, Many, Natural, Pixels, Rate, Section, Seed, Share


class StartParams(Section):
    """Charts that are tried for the subject as it was found."""

    centres: Annotated[Many[Annotated[float, Field(ge=-10, le=10)]], Field(min_length=1, max_length=1000)] = (
        *(-0.05, -0.1, -0.15, -0.2, -0.25),
        *(-0.3, -0.35, -0.4),
    )
    """Candidates for x of the sphere centre c = (x, 0, 0), units. The paper's is -0.25."""

    belts: Annotated[Many[Annotated[float, Field(ge=0, le=80)]], Field(max_length=100)] = (10.0, 30.0)
    """Candidates for a belt, degrees below level, tried with each centre beside the plain sphere. Below it rays start
    lower on the neck's axis."""

    centre_tie: ClassVar[float] = 0.002
    view_tie: ClassVar[float] = 0.015
    """Of the charts within the first of the least loss of visible surface, and within the second of the least loss of
    what the camera sees that loses most, the one farthest back wins."""

    centre_nodes: ClassVar[int] = 96
    """Rows of the coarse radius map by which charts are compared."""

    window_limit: ClassVar[float] = 0.9
    """Largest |u| of a window: at the poles a radius map has no meaning."""

    column_limit: ClassVar[float] = 1.5
    """Largest -u of a window below a belt."""

    azimuth_limit: ClassVar[float] = 1.5
    """Largest |v| of a window; 1 is straight sideways from c."""

    around_limits: ClassVar[tuple[float, float]] = (0.995, 2.0)
    """The same, |u| and |v|, of a subject that was filmed all around: it is closed behind, and at the poles but for
    half a degree, a millimetre of a crown."""

    subject_opacity: ClassVar[float] = 0.5
    """Opacity of the subject's Gaussians from which on a direction holds the subject."""


class GeometryParams(Section):
    """The radius maps of the layers, and the rounds in which they move to the opacity found."""

    nodes: Annotated[int, Field(ge=8, le=4096)] = 384
    """Nodes along the longer side of the radius maps."""

    halfwidth: Annotated[float, Field(gt=0, lt=0.2)] = 0.003
    """The layers lie within this distance of the surface, units, where the start is sharp; within 1.5 pixels
    where these are larger."""

    max_halfwidth: Length = 0.015
    """Largest distance of a layer from the surface, units."""

    rounds: Annotated[Many[Annotated[float, Field(gt=0, le=100)]], Field(min_length=1, max_length=100)] = (
        2.5,
        1.6,
        1.0,
    )
    """Halfwidths of the rounds of geometry, in halfwidths of the model."""

    round_iterations: Count = 60
    """Adam steps of each round."""

    blur: Pixels = 6.0
    """Smoothing of the layers' motion between rounds, standard deviation, nodes. With eight cameras 12 gained,
    with thinner layers."""


class GridTextureParams(Section):
    """The texel grids: how fine, and how they are trained. Rates are Adam's."""

    pixels_per_texel: Annotated[float, Field(ge=0.1, le=1000)] = 1.0
    """Of the finest textures, seen head on from the median camera. Finer ones than a pixel cost more bytes and time,
    and lose over other backgrounds what they gain inside."""

    rays_per_texel: Factor = 2.5
    """Of one frame, in one step: each texel is met, few rays twice."""

    learning_rate: Rate = 0.02
    """Of the colours shared by layers and frames; it falls along the last level. The other rates are factors on it."""

    steps_per_frame: Count = 20
    """Of the iterations after the rounds of geometry there are at least so many a frame of the capture: two fifths of
    them at half resolution. With a fixed number a film of 200 frames stood still (6 % of what changes was explained,
    against 28 % with 20 frames); twelve frames have 23 without it."""

    smooth_every: Count = 3
    """Steps between smoothings of opacity over neighbouring texels, at half and full resolution: left alone, opacity
    becomes grain that shows each camera its own picture."""


class FollowParams(Section):
    """After the levels at half and at full resolution: steps of each frame alone, where it does not follow yet what
    moves."""

    min_error: Annotated[float, Field(gt=0, le=1)] = 0.02
    """A texel does not follow a frame whose mean error over the rays that meet it differs by more than this, in a
    channel, from its median over the frames; its eight neighbours move with it. Where a texel does not follow one
    frame, the others are asked by their whole error."""

    min_light: Share = 0.3
    """Rays count of whose light at least this share comes to such texels."""

    steps: Count = 30
    """A frame, each on every second one of these rays, fewer where these are many; the rates fall along them."""

    rate: Rate = 0.02
    """Adam's, of colours; logits of alpha move faster, as in the training."""


class ReflectionParams(Section):
    """The shared reflection: gloss(s, t) times an environment in the reflected direction."""

    enabled: bool = True
    """Try a reflection; it is left out all the same where it does not help."""

    begin: Literal["rounds", "end"] = "rounds"
    """When the reflection is first fitted: in the first round of geometry, or to finished textures. "end" is best for
    programs that cannot draw it (GLB, OpenUSD)."""

    texels: Annotated[int, Field(ge=2, le=256)] = 96
    """Texels of the maps of gloss, offset and normals, along the window's longer side."""

    environment_texels: Annotated[int, Field(ge=2, le=256)] = 16
    """Texels a side of the environment's picture."""

    fits: Annotated[int, Field(ge=1, le=100)] = 3
    """Fits in each level of training, the last at its end."""


class SegmentParams(Section):
    """A long take: a model of its key frames, the base, and each frame fitted alone against it."""

    joint_frames: Natural = 24
    """Takes of at most so many frames are trained at once if memory allows, longer ones in segments: as good, with a
    third fewer bytes of video. 0 trains every take in segments."""

    memory_megabytes: Count = 8192
    """Memory for the textures of a training at once, MB. A fixed number, so that a take gives the same model on every
    machine."""

    key_frames: Annotated[int, Field(ge=1, le=10_000)] = 12
    """Frames of which the base is made, at most."""

    frames: Count = 12
    """Frames of a segment: the most that is lost when a training is killed."""

    steps: Count = 4
    """Steps of each frame against the base, all at full resolution."""

    processes: Natural = 0
    """Processes that fit segments at once. 0: as many as cores, memory and work allow; 1: the training's own. The
    result does not depend on it."""


class ExplicitParams(Section):
    """Model `explicit`: nested radius maps with texel grids. Its defaults are the preset `fast`."""

    preset: str = "fast"
    """Its values fill the keys that are not given. `fast` is the explicit model; `quick` and `paper` are
    perceptrons."""

    model: Literal["explicit"] = "explicit"
    """Follows from the preset."""

    seed: Seed = 0
    """Seed of the draws of rays and frames."""

    layers: Annotated[int, Field(ge=1, le=64)] = 12
    """Number of nested layers, N. Where cameras see beneath an overhang there are four more."""

    iterations: Count = 300
    """Adam steps of rounds and textures together. More are made where `geometry` or `textures.steps_per_frame` need
    them. Four times 460 lost 0.3 dB on cameras left out, since layers begin to show each camera its own picture."""

    start: StartParams = StartParams()
    """Charts that are tried for the subject as it was found."""

    geometry: GeometryParams = GeometryParams()
    """The radius maps."""

    textures: GridTextureParams = GridTextureParams()
    """The texel grids."""

    follow: FollowParams = FollowParams()
    """What moves."""

    reflection: ReflectionParams = ReflectionParams()
    """What gloss adds, by the direction."""

    segments: SegmentParams = SegmentParams()
    """Of takes that are too long to be trained at once."""

    @property
    def least_iterations(self) -> int:
        """That are run even if fewer are asked for: all rounds, and a few with the final geometry."""
        return self.geometry.round_iterations * len(self.geometry.rounds) + 3
