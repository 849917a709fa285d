"""What stands around the subject, with parallax: a coarse volume of all space beyond a ball, contracted towards
infinity, and behind it the far sphere of `environment.py`.

Without it a near wall can only be explained by fog around the head."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.params import EnvironmentParams, RoomParams
from facefolds_core.training.adam import corrections, decays
from facefolds_core.training.volume import kernel, room_kernel
from facefolds_core.training.volume.environment import Environment

Array = NDArray[np.float32]


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
        farthest: distance of the farthest camera from the origin, units.
        radius: of the ball, units.
        params: of the outer zone, and of the far sphere behind it.
    """

    def __init__(
        self, colour: Array, farthest: float, radius: float, params: RoomParams, environment: EnvironmentParams
    ) -> None:
        self.environment = Environment(colour, farthest, environment)
        self.radius, self.params = radius, params
        self.outer = False
        self.grid = np.zeros((3, 2, 2, 2, 4), np.float32)
        # From the ball to infinity it is one radius in the contracted space, and the grid spans four.
        self.grid[0, ..., 0] = math.log(math.expm1(4 * params.fog))
        self.grid[0, ..., 1:] = colour
        self._steps = 0

    @property
    def step_length(self) -> float:
        """Between samples, contracted radii."""
        return self.params.step * 4 / (int(self.grid.shape[1]) - 1)

    def refine(self, voxels: int) -> None:
        """Have an outer zone of so many voxels a side, resampled; Adam's moments start afresh. Before the first call
        the far sphere is all there is."""
        self.outer = True
        old = self.grid[0]
        at = np.meshgrid(*[np.linspace(0, len(old) - 1, voxels)] * 3, indexing="ij")
        values = np.stack([ndimage.map_coordinates(old[..., q], at, order=1, mode="nearest") for q in range(4)], -1)
        # Densities are optical depths of a voxel.
        depth = np.logaddexp(0, values[..., 0]) * (len(old) - 1) / (voxels - 1)
        values[..., 0] = np.log(np.expm1(np.maximum(depth, 1e-5)))
        self.grid = np.stack([values.astype(np.float32), *np.zeros((2, *values.shape), np.float32)])
        self._gradient, self._touched = kernel.empty_gradient(values.shape)
        self._share = np.ones(values.shape[:3], np.float32)
        self._steps = 0

    def look_up(self, origins: Array, directions: Array) -> Array:
        """Colours (R, 3) of rays (R, 3)."""
        return self.look(origins, directions, np.full(len(origins), 0.5, np.float32)).colours

    def look(self, origins: Array, directions: Array, jitter: Array) -> Looked:
        """Rays (R, 3) as `step` needs them; `jitter` (R,) in [0, 1) says where in its step each sample lies."""
        far, taps, weights = self.environment.look_up(origins, directions)
        if not self.outer:
            return Looked(origins, directions, jitter, far, np.ones(len(far), np.float32), far, taps, weights)
        rgb, through = self._see(origins, directions, jitter)
        colours = (rgb + through[:, None] * far).astype(np.float32)
        return Looked(origins, directions, jitter, colours, through, far.astype(np.float32), taps, weights)

    def step(self, seen: Looked, slope: Array, scale: float, rate: float, colour_rate: float) -> None:
        """One Adam step; `refine` comes before the first.

        Args:
            slope: (R, 3) of the loss in the colours that were seen.
            scale: factor on the far sphere's rate.
            rate, colour_rate: learning rates of raw density and colours.
        """
        self.environment.step(seen.taps, seen.weights, seen.through[:, None] * slope, scale)
        if not self.outer:
            return
        self._splat(seen, slope)
        self._steps += 1
        self._move((rate, colour_rate, *corrections(self.params.betas, self._steps)))

    def forget_unseen(self, origins: Array, directions: Array, through: Array) -> None:
        """Give voxels that no rays (R, 3) have reached, with transmittances (R,), the colours of their neighbours."""
        if not self.outer:
            return
        seen = self.look(origins, directions, np.full(len(origins), 0.5, np.float32))
        self._splat(seen, np.repeat(through[:, None], 3, 1))
        weight = self._take_splatted()[..., 1]
        colours = self.grid[0, ..., 1:]
        guess = np.broadcast_to(np.average(colours.reshape(-1, 3), 0, weight.ravel() + 1e-9), colours.shape)
        for blur in (16.0, 8.0, 4.0, 2.0):
            mass = ndimage.gaussian_filter(weight, blur)[..., None]
            mean = np.stack([ndimage.gaussian_filter(weight * colours[..., q], blur) for q in range(3)], -1)
            guess = (mean + 0.01 * guess) / (mass + 0.01)
        trust = weight[..., None] / (weight[..., None] + self.params.seen_rays)
        self.grid[0, ..., 1:] = trust * colours + (1 - trust) * guess

    def _see(self, origins: Array, directions: Array, jitter: Array) -> tuple[Array, Array]:
        """Colours (R, 3) of the outer zone over black, and transmittances (R,)."""
        lengths = self.radius, self.step_length, self.params.farthest
        rgb, through = room_kernel.look(origins, directions, jitter, self.grid[0], *lengths)
        return rgb, through

    def _move(self, rates: tuple[float, ...]) -> None:
        """Adam's step; rates: of density and colour, and both corrections."""
        decay, smoothness = decays(self.params.betas), self.params.smoothness_weight
        kernel.adam_step(self.grid, self._gradient, self._touched, self._share, *rates, decay, smoothness)

    def _take_splatted(self) -> Array:
        """The gradient (M, M, M, 4) that was added up, which is 0 afterwards."""
        total: Array = self._gradient.sum(0)
        self._gradient[:], self._touched[:] = 0, False
        return total

    def _splat(self, seen: Looked, slope: Array) -> None:
        """Add the gradient of sum slope . colour."""
        length = self.step_length
        room_kernel.splat(
            seen.origins,
            seen.directions,
            seen.jitter,
            self.grid[0],
            self.radius,
            length,
            self.params.farthest,
            int(8 / length),
            seen.far,
            slope.astype(np.float32),
            self._gradient,
            self._touched,
        )


def room_type(gpu: bool) -> type[Room]:
    """The class whose outer zone is looked at there."""
    if not gpu:
        return Room
    from facefolds_core.training.volume.steps_gpu import GpuRoom

    return GpuRoom
