"""`train` of the model `explicit`: radius maps, texel grids (docs/reference/method.md). Preset `fast`: the defaults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Betas, Count, Factor, Rate, Section, Seed, Share
from facefolds_core.params.pruning import PruningParams
from facefolds_core.params.reflection import ReflectionParams
from facefolds_core.params.segments import SegmentParams
from facefolds_core.params.surfaces import GeometryParams, MeshParams, StartParams


class GridTextureParams(Section):
    """The texel grids: how fine, and how they are trained. Rates are Adam's."""

    pixels_per_texel: Annotated[float, Field(ge=0.1, le=1000)] = 1.2
    """Of the finest textures, seen head on from the median camera. Of textures that are trained with a reflection 1.2
    measured 0.1 to 0.3 dB better than 1.5 on cameras left out, one pixel a texel 0 to 0.2 dB worse: some thirty cameras
    do not determine so many texels of twelve layers."""

    radius_quantile: Share = 0.9
    """`pixels_per_texel` holds on a sphere of this quantile of the radii of what is opaque: nearly the farthest, where
    texels are largest."""

    rays_per_texel: Factor = 2.5
    """Of one frame, in one step: each texel is met, few rays twice."""

    learning_rate: Rate = 0.02
    """Of the colours shared by layers and frames; it falls along the last level. The other rates are factors on it."""

    full_rate_iterations: Count = 460
    """Of more `iterations` than these, the steps at half and full resolution are smaller in proportion, and decay
    and smoothing with them: they go the same way more finely. At full rate four times as many lost 0.3 dB
    on cameras left out (`mugsy`, `studio`), since layers begin to show each camera its own picture."""

    final_rate: Annotated[float, Field(gt=0, le=1)] = 0.1
    """To this part of itself every rate falls along the last level: the noise of single steps settles."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2: shares of the moments that a step keeps. The second is lower than the usual 0.999: a
    level has some hundred steps, and a texel is met in few of them."""

    layer_rate: Rate = 0.3
    """Learning rate of the layers' own colours, against `learning_rate`: they are small changes."""

    alpha_rate: Rate = 15.0
    """Learning rate of the logits of alpha, against `learning_rate`: logits move over eighteen units, colours over
    one."""

    frame_rate: Rate = 0.5
    """Learning rate of the frames' parts, against those of what is shared."""

    frame_decay: Annotated[float, Field(gt=0, le=1)] = 0.999
    """The frames' parts shrink by this factor each step towards what is shared: what every frame shows belongs
    there."""

    half_share: Annotated[float, Field(gt=0, lt=1)] = 0.4
    """Of the iterations after the rounds of geometry, at half of the final texels a side; the others are at full
    resolution."""

    steps_per_frame: Count = 20
    """Of the iterations after the rounds of geometry there are at least so many a frame of the capture: two fifths of
    them at half resolution. With a fixed number a film of 200 frames stood still (6 % of what changes was explained,
    against 28 % with 20 frames); twelve frames have 23 without it."""

    smooth_every: Count = 3
    """Steps between smoothings of opacity over neighbouring texels, at half and full resolution: left alone, opacity
    becomes grain that shows each camera its own picture."""

    min_light: Share = 0.002
    """Layers behind less transmittance are skipped: speed, half a code of a pixel."""

    min_alpha: Share = 0.002
    """Layers with less alpha are skipped once the textures are at half resolution: speed, half a code of a pixel."""


class FollowParams(Section):
    """After the levels at half and at full resolution: steps of each frame alone, where it does not follow yet what
    moves."""

    min_error: Annotated[float, Field(gt=0, le=1)] = 0.02
    """A texel does not follow a frame whose mean error over the rays that meet it differs by more than this, in a
    channel, from its median over the frames; its eight neighbours move with it. Where a texel does not follow one
    frame, the others are asked by their whole error."""

    min_share: Share = 0.3
    """Rays count of whose colour at least this share is of such texels."""

    steps: Count = 30
    """A frame, each on every second one of these rays, fewer where these are many; the rates fall along them."""

    rate: Rate = 0.02
    """Adam's, of colours; of logits of alpha times `textures.alpha_rate`."""


class MovingParams(Section):
    """What a head that turns (`normalize.stabilize`) needs beside: its rays meet other texels in each frame."""

    cache_megabytes: Annotated[int, Field(ge=0, le=1_000_000)] = 2048
    """Memory for the crossings of all frames' rays, MB; what does not fit is traced anew each time."""

    shares: Count = 3
    """Shares of a frame's rays that are traced, each as large as a step takes."""

    sample: Count = 64
    """One ray in so many is looked at to estimate how many meet the subject."""

    sample_frames: Count = 6
    """Frames in which `moving.sample` looks at rays."""


class DivergenceParams(Section):
    """When a level of training is begun again, and how often."""

    error_ratio: Annotated[float, Field(gt=1, le=1e6)] = 9.0
    """A squared error this many times the best of its level is a divergence."""

    smoothing: Annotated[float, Field(gt=0, le=1)] = 0.1
    """Share of the newest step in the running mean of the error."""

    attempts: Annotated[int, Field(ge=1, le=100)] = 4
    """Attempts, each at a lower learning rate; then training ends with a message."""

    slow_down: Annotated[float, Field(gt=1, le=1000)] = 3.0
    """The learning rate is divided by this before a level is begun again."""


class GpuParams(Section):
    """With `device: cuda`."""

    cache_megabytes: Annotated[int, Field(ge=0, le=1_000_000)] = 4096
    """GPU memory for pictures and crossings of frames, MB; what does not fit is sent again when needed."""


class ExplicitParams(Section):
    """Model `explicit`: nested radius maps with texel grids. Its defaults are the preset `fast`."""

    preset: str = "fast"
    """Its values fill the keys that are not given. `fast` is the explicit model; `quick` and `paper` are
    perceptrons."""

    model: Literal["explicit"] = "explicit"
    """Follows from the preset."""

    device: Literal["auto", "cpu", "cuda"] = "auto"
    """ "cuda" needs the extra `cuda` and an NVIDIA GPU; "auto" is "cpu", since no GPU has been measured yet."""

    gpu: GpuParams = GpuParams()
    """What a GPU needs beside."""

    seed: Seed = 0
    """Seed of the draws of rays and frames."""

    layers: Annotated[int, Field(ge=1, le=64)] = 12
    """Number of nested layers, N."""

    iterations: Count = 460
    """Adam steps of rounds and textures together. More are made where `geometry` or `textures.steps_per_frame` need
    them."""

    start: StartParams = StartParams()
    """What the layers take from the subject as it was found."""

    mesh: MeshParams = MeshParams()
    """How far a tracked mesh is believed."""

    geometry: GeometryParams = GeometryParams()
    """The radius maps."""

    textures: GridTextureParams = GridTextureParams()
    """The texel grids."""

    follow: FollowParams = FollowParams()
    """What moves."""

    reflection: ReflectionParams = ReflectionParams()
    """What gloss adds, by the direction."""

    moving: MovingParams = MovingParams()
    """Of a head that turns."""

    segments: SegmentParams = SegmentParams()
    """Of takes that are too long to be trained at once."""

    pruning: PruningParams = PruningParams()
    """What is left out in the end."""

    divergence: DivergenceParams = DivergenceParams()
    """When training starts again."""

    @property
    def least_iterations(self) -> int:
        """That are run even if fewer are asked for: all rounds, and a few with the final geometry."""
        return self.geometry.round_iterations * len(self.geometry.rounds) + 3
