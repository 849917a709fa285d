"""`train.few_cameras`: what a training of few cameras does otherwise."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from facefolds_core.params.base import Count, Length, Natural, Pixels, Section, Weight


class FewCameraParams(Section):
    """Values that hold before few training cameras, where they are stricter than the usual ones. Haze and lumps would
    else show each camera its own picture."""

    at_most: Natural = 10
    """Largest number of training cameras that counts as few; 0 is never."""

    views: Count = 2
    """Cameras that must see a voxel at least, however many cameras there are."""

    shared_views: Count = 5
    """With plates: cameras from which on the fog of the start is fully thick. Without, `views` + 1."""

    opacity_weight: Weight = 0.003
    """With plates: least value of `volume.opacity_weight`."""

    max_halfwidth: Length = 0.008
    """With plates: largest value of `geometry.max_halfwidth`, units."""

    blur: Pixels = 12.0
    """With plates: least value of `geometry.blur`, nodes."""

    pixels_per_texel: Annotated[float, Field(ge=0.1, le=1000)] = 2.5
    """Without plates: least value of `textures.pixels_per_texel`."""

    @model_validator(mode="after")
    def _shared_is_more(self) -> Self:
        if self.shared_views <= self.views:
            raise ValueError("shared_views must be larger than views")
        return self
