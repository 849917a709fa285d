"""What stands around the subject, with parallax: a coarse volume of all space beyond a ball, contracted towards
infinity, and behind it the far sphere of `environment.py`.

Without it a near wall can only be explained by fog around the head."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.training.volume import kernel, room_kernel
from facefolds_core.training.volume.environment import Environment

Array = NDArray[np.float32]

FOG = 1.0
"""Optical depth of the outer zone at the start, from the ball to infinity."""

STEP = 0.7
"""Between samples, voxels."""

RATE_COLOUR = 0.03
SMOOTH = 0.001
"""Price of differences between neighbours' raw densities."""


@dataclass(frozen=True)
class Looked:
    """R rays and what they saw of a room.

    Attributes:
        origins, directions: (R, 3); jitter: (R,).
        colours: (R, 3).
        through: (R,) transmittance of the outer zone.
        far: (R, 3) colours of the far sphere; taps, weights: (R, 4) of its texels.
    """

    origins: Array
    directions: Array
    jitter: Array
    colours: Array
    through: Array
    far: Array
    taps: NDArray[np.intp]
    weights: Array


class Room:
    """Colours of rays that have left the ball of `radius` around the origin; trained by Adam.

    Args:
        colour: (3,) to start with.
        reach: distance of the farthest camera from the origin, units.
        radius: of the ball, units.
        voxels: a side of the outer zone's grid.
    """

    def __init__(self, colour: Array, reach: float, radius: float, voxels: int) -> None:
        self.environment = Environment(colour, reach)
        self.radius = radius
        values = np.empty((voxels, voxels, voxels, 4), np.float32)
        # From the ball to infinity it is one radius in the contracted space.
        values[..., 0] = math.log(math.expm1(4 * FOG / (voxels - 1)))
        values[..., 1:] = colour
        self._start(values)

    def _start(self, values: Array) -> None:
        self.grid = np.stack([values, np.zeros_like(values), np.zeros_like(values)])
        self._gradient = np.zeros((kernel.PARTS, *values.shape), np.float32)
        self._share = np.ones(values.shape[:3], np.float32)
        self._steps = 0

    @property
    def step_length(self) -> float:
        """Between samples, contracted radii."""
        return STEP * 4 / (int(self.grid.shape[1]) - 1)

    def refine(self, voxels: int) -> None:
        """Resample to so many voxels a side; Adam's moments start afresh."""
        old = self.grid[0]
        at = np.meshgrid(*[np.linspace(0, len(old) - 1, voxels)] * 3, indexing="ij")
        values = np.stack([ndimage.map_coordinates(old[..., q], at, order=1, mode="nearest") for q in range(4)], -1)
        # The optical depth is that of a voxel.
        depth = np.logaddexp(0, values[..., 0]) * (len(old) - 1) / (voxels - 1)
        values[..., 0] = np.log(np.expm1(np.maximum(depth, 1e-5)))
        self._start(values.astype(np.float32))

    def look_up(self, origins: Array, directions: Array) -> Array:
        """Colours (R, 3) of rays (R, 3)."""
        return self.look(origins, directions, np.full(len(origins), 0.5, np.float32)).colours

    def look(self, origins: Array, directions: Array, jitter: Array) -> Looked:
        """Rays (R, 3) as `step` needs them; `jitter` (R,) in [0, 1) says where in its step each sample lies."""
        rgb, through = room_kernel.look(origins, directions, jitter, self.grid[0], self.radius, self.step_length)
        far, taps, weights = self.environment.look_up(origins, directions)
        colours = (rgb + through[:, None] * far).astype(np.float32)
        return Looked(origins, directions, jitter, colours, through, far.astype(np.float32), taps, weights)

    def step(self, seen: Looked, slope: Array, scale: float, rate: float) -> None:
        """One Adam step.

        Args:
            slope: (R, 3) of the loss in the colours that were seen.
            scale: factor on all rates.
            rate: learning rate of raw density.
        """
        self.environment.step(seen.taps, seen.weights, seen.through[:, None] * slope, scale)
        length = self.step_length
        room_kernel.splat(
            seen.origins,
            seen.directions,
            seen.jitter,
            self.grid[0],
            self.radius,
            length,
            int(8 / length),
            seen.far,
            slope.astype(np.float32),
            self._gradient,
        )
        self._steps += 1
        bias1, bias2 = 1 / (1 - kernel.BETA1**self._steps), 1 / (1 - kernel.BETA2**self._steps)
        kernel.adam_step(
            self.grid, self._gradient, self._share, scale * rate, scale * RATE_COLOUR, bias1, bias2, SMOOTH
        )
