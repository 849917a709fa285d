"""`train` of the model `explicit`: radius maps, texel grids (docs/reference/method.md). Preset `fast`: the defaults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Rate, Section, Seed, Share
from facefolds_core.params.reflection import ReflectionParams
from facefolds_core.params.segments import SegmentParams
from facefolds_core.params.surfaces import GeometryParams, StartParams


class GridTextureParams(Section):
    """The texel grids: how fine, and how they are trained. Rates are Adam's."""

    pixels_per_texel: Annotated[float, Field(ge=0.1, le=1000)] = 1.0
    """Of the finest textures, seen head on from the median camera. Finer ones than a pixel cost more bytes and time,
    and lose over other backgrounds what they gain inside."""

    rays_per_texel: Factor = 2.5
    """Of one frame, in one step: each texel is met, few rays twice."""

    learning_rate: Rate = 0.02
    """Of the colours shared by layers and frames; it falls along the last level. The other rates are factors on it."""

    full_rate_iterations: Count = 460
    """Of more `iterations` than these, the steps at half and full resolution are smaller in proportion, and smoothing
    is rarer: they go the same way more finely. At full rate four times as many lost 0.3 dB
    on cameras left out (`mugsy`, `studio`), since layers begin to show each camera its own picture."""

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
    them."""

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
