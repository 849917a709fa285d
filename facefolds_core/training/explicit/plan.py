"""The levels of a training of the explicit model: how fine, how long, how thick."""

from __future__ import annotations

from dataclasses import dataclass

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.fit import Fit


@dataclass(frozen=True)
class Level:
    """One stretch of training.

    Attributes:
        texels: (H, W).
        iterations: steps.
        stride: of the pixels that are traced.
        geometry: halfwidths of the layers, in those of the fit.
        last: the learning rates fall along it.
    """

    texels: tuple[int, int]
    iterations: int
    stride: int
    geometry: float
    last: bool


def plan(fit: Fit, params: ExplicitParams) -> list[Level]:
    """Rounds of geometry, quarter, half and full resolution."""

    def size(divisor: int) -> tuple[int, int]:
        return max(16, fit.texels[0] // divisor), max(16, fit.texels[1] // divisor)

    geometry = params.geometry
    levels = [
        Level(size(4), geometry.round_iterations, geometry.round_stride, scale, False) for scale in geometry.rounds
    ]
    rest = max(params.iterations, params.least_iterations) - geometry.round_iterations * len(levels)
    half = round(params.textures.half_share * rest)
    levels.append(Level(size(2), half, 1, geometry.rounds[-1], False))
    levels.append(Level(fit.texels, rest - half, 1, geometry.rounds[-1], True))
    return levels
