"""What all sections of params.yaml have in common: strict types, bounds, descriptions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field

T = TypeVar("T")


class Section(BaseModel):
    """Base of all sections: frozen; unknown keys, NaN, infinities, and strings or true and false for numbers refused.

    The string below each field is its description: with its unit, and the reason for its default.
    docs/reference/params.md is made of them.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


Many = Annotated[tuple[T, ...], Field(strict=False)]
"""A list in YAML; its items are strict all the same."""

Pair = Annotated[tuple[T, T], Field(strict=False)]

Triple = Annotated[tuple[T, T, T], Field(strict=False)]

Coordinate = Annotated[float, Field(ge=-1e9, le=1e9)]
"""In the capture's world; no number of a calibration is larger."""

Count = Annotated[int, Field(ge=1, le=100_000_000)]
"""How many, at least one. A hundred million is beyond any machine that this runs on."""

Natural = Annotated[int, Field(ge=0, le=100_000_000)]

Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]

Share = Annotated[float, Field(ge=0, le=1)]
"""Of a whole; opacities, transmittances and colours too."""

Length = Annotated[float, Field(gt=0, le=10)]
"""Units of the scene: cameras are about 1 away from the subject."""

Rate = Annotated[float, Field(gt=0, le=1000)]
"""A learning rate, or a factor on one."""

Weight = Annotated[float, Field(ge=0, le=1e6)]
"""Of a term of a loss; 0 leaves it out."""

Factor = Annotated[float, Field(gt=0, le=1e6)]
"""A positive number without a unit."""

Pixels = Annotated[float, Field(gt=0, le=1e6)]
"""Pixels, texels, voxels or nodes, fractions included."""

ImageSide = Annotated[int, Field(ge=16, le=32_768)]
"""Pixels."""

TextureSide = Annotated[int, Field(ge=8, le=4096)]
"""Texels."""

FrameRate = Annotated[float, Field(ge=0.01, le=10_000)]
"""Frames a second: from one in a hundred seconds to what a high-speed camera takes."""


def merged(base: Mapping[str, Any], override: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with the values of `override`, sections within sections key by key."""
    result = dict(base)
    for key, value in override.items():
        old = result.get(key)
        result[key] = merged(old, value) if isinstance(value, dict) and isinstance(old, dict) else value
    return result
