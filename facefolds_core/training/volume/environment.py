"""What is behind the subject, shared by all cameras: one blurred picture on a large sphere.

All cameras look at the same far sphere, so it can take up the walls of a room but not the subject, which moves
against it from camera to camera. A background of its own for each camera could explain everything."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from facefolds_core.params import EnvironmentParams
from facefolds_core.training.adam import EPSILON

Array = NDArray[np.float32]


class Environment:
    """Colours where rays leave the sphere, bilinear; trained by Adam.

    Args:
        colour: (3,) to start with.
        reach: distance of the farthest camera from the origin, units.
        params: its size and rate.
    """

    def __init__(self, colour: Array, reach: float, params: EnvironmentParams) -> None:
        self.params = params
        self.radius = params.radius * reach
        self.values = np.tile(colour.astype(np.float32), (params.rows * 2 * params.rows, 1))
        self._moments = np.zeros((2, *self.values.shape), np.float64)
        self._steps = 0

    def look_up(self, origins: Array, directions: Array) -> tuple[Array, NDArray[np.intp], Array]:
        """Colours (R, 3) of rays from inside the sphere; their texels (R, 4) and weights (R, 4)."""
        rows = self.params.rows
        along = (origins * directions).sum(1)
        inside = (origins * origins).sum(1) - self.radius**2
        exit_point = origins + (np.sqrt(along * along - inside) - along)[:, None] * directions
        x, y, z = (exit_point / np.linalg.norm(exit_point, axis=1, keepdims=True)).T
        row = (np.arccos(z.clip(-1, 1)) / math.pi * rows - 0.5).clip(0, rows - 1)
        # The seam lies at +x, behind the cameras.
        column = ((np.arctan2(y, -x) / math.pi + 1) * rows - 0.5).clip(0, 2 * rows - 1)
        i, j = np.minimum(row.astype(np.intp), rows - 2), np.minimum(column.astype(np.intp), 2 * rows - 2)
        a, b = (row - i).astype(np.float32), (column - j).astype(np.float32)
        first = i * 2 * rows + j
        taps = np.stack([first, first + 1, first + 2 * rows, first + 2 * rows + 1], 1)
        weights = np.stack([(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b], 1)
        return (self.values[taps] * weights[..., None]).sum(1), taps, weights

    def step(self, taps: NDArray[np.intp], weights: Array, slope: Array, scale: float) -> None:
        """One Adam step; slope (R, 3) of the loss in the colours that were looked up, `scale` times the rate."""
        size = len(self.values)
        gradient = np.stack(
            [np.bincount(taps.ravel(), (weights * slope[:, q : q + 1]).ravel(), minlength=size) for q in range(3)], 1
        )
        self._steps += 1
        first, second = self._moments
        keep1, keep2 = self.params.betas
        first += (1 - keep1) * (gradient - first)
        second += (1 - keep2) * (gradient**2 - second)
        move = first / (1 - keep1**self._steps) / (np.sqrt(second / (1 - keep2**self._steps)) + EPSILON)
        self.values = np.where(gradient != 0, self.values - scale * self.params.learning_rate * move, self.values)
        self.values = self.values.clip(0, 1).astype(np.float32)
