"""`train.few_cameras`: what a training of few cameras does otherwise."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from facefolds_core.params.base import Count, Length, Natural, Pixels, Section, Weight


class FewCameraParams(Section):
    """Between few cameras hardly anything is determined: the starting volume becomes haze and lumps that show each
    camera its own picture. Against that these values hold where they are the stricter ones. Those of opacity and
    geometry only where each camera has a clean plate: without, a price on opacity takes the subject for what stands
    behind it (`mugsy`); that of texels only where one has none."""

    at_most: Natural = 10
    """Training cameras that are few; 0 is none ever. All but `views` is of these."""

    views: Count = 2
    """Cameras that must see a voxel at least, however many there are (`volume.min_view_share`, in cameras): a share of
    few is less than one. Of a turning head before more than `at_most` the share of its views alone counts."""

    shared_views: Count = 5
    """With plates: cameras from which on the fog of the start is as thick as anywhere (`volume.shared_view_share`, in
    cameras). Without, one more than `views`: thinner fog in a room that is not known became no subject at all."""

    opacity_weight: Weight = 0.003
    """With plates: at least, of `volume.opacity_weight`: haze beside the subject costs more."""

    max_halfwidth: Length = 0.008
    """With plates: at most, of `geometry.max_halfwidth`, units: such a volume is blurred everywhere, and layers as far
    apart as it is thick each show another camera's picture."""

    blur: Pixels = 12.0
    """With plates: at least, of `geometry.blur`, nodes: rounds of geometry make lumps of what single cameras want."""

    pixels_per_texel: Annotated[float, Field(ge=0.1, le=1000)] = 2.5
    """Without plates: at least, of `textures.pixels_per_texel`: finer texels show each camera its own picture."""

    @model_validator(mode="after")
    def _shared_is_more(self) -> Self:
        if self.shared_views <= self.views:
            raise ValueError("shared_views must be larger than views")
        return self
