"""The levels of a training of the explicit model: how fine, how long, how thick."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.fit import Fit

HALF_SHARE = 0.4
"""Of the iterations after the rounds of geometry, at half of the final texels a side; the others are at full
resolution."""

SETTLING = 0.6
"""From this part of the last level on, steps are compared over all colours at once, not over one each."""

ROUND_STRIDE = 8
"""At most every n-th pixel is looked at in the rounds of geometry."""

ROUND_RAYS = 250_000
"""Rays of all cameras that are looked at in the rounds, at least, if there are as many."""


@dataclass(frozen=True)
class TrainingLevel:
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


def epochs(frames: int, random: np.random.Generator) -> Iterator[int]:
    """Frames in the order in which steps take them: without replacement, shuffled anew each time all have been taken.

    Args:
        frames: K.
        random: draws the orders.
    """
    while True:
        yield from reversed(random.permutation(frames).tolist())


def plan(fit: Fit, params: ExplicitParams, frames: int, pixels: int) -> list[TrainingLevel]:
    """Rounds of geometry at a quarter of the resolution; half and full resolution, with their steps a frame.

    Args:
        frames: K.
        pixels: of all training cameras in one frame.
    """

    def size(divisor: int) -> tuple[int, int]:
        return max(16, fit.texels[0] // divisor), max(16, fit.texels[1] // divisor)

    geometry = params.geometry
    stride = max(1, min(ROUND_STRIDE, pixels // ROUND_RAYS))
    levels = [TrainingLevel(size(4), geometry.round_iterations, stride, scale, False) for scale in geometry.rounds]
    rounds, least = geometry.round_iterations * len(levels), params.textures.steps_per_frame * frames
    rest = max(max(params.iterations, params.least_iterations) - rounds, least)
    half = round(HALF_SHARE * rest)
    levels.append(TrainingLevel(size(2), half, 1, geometry.rounds[-1], False))
    levels.append(TrainingLevel(fit.texels, max(rest - half, frames), 1, geometry.rounds[-1], True))
    return levels
