"""The volume's fit on an NVIDIA GPU: the CPU's kernels, and what is taken to and fro between them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core import gpu
from facefolds_core.params import VolumeParams
from facefolds_core.training.adam import decays
from facefolds_core.training.volume import kernels_gpu
from facefolds_core.training.volume.room import Looked, Room
from facefolds_core.training.volume.steps import Steps

if TYPE_CHECKING:
    from facefolds_core.training.volume.optimise import Rays

Array = NDArray[np.float32]

SUMS = 64
"""Over which squared errors are spread, so that threads seldom wait for one another."""

AT_ONCE = 16384
"""Rays, each with room for all its samples: 48 bytes each."""


class Grid:
    """Values and moments (3, X, Y, Z, 4) on the GPU, with gradient, and room for the samples of rays."""

    def __init__(self, grid: Array, share: Array) -> None:
        shape = grid.shape[1:]
        self.all, self.share = gpu.to_gpu(grid), gpu.to_gpu(share)
        self.gradient, self.touched = gpu.zeros((1, *shape)), gpu.zeros((1, *shape[:2]), np.bool_)
        self._old = gpu.empty(shape[:3])
        self._scratch: tuple[Any, Any] | None = None

    def scratch(self, rays: int, samples: int) -> tuple[Any, Any]:
        """Room for `samples` of each of so many rays."""
        shape = (samples, min(rays, AT_ONCE))
        if self._scratch is None or self._scratch[0].shape[:2] != shape:
            self._scratch = None
            self._scratch = gpu.empty((*shape, 3), np.int32), gpu.empty((*shape, 9))
        return self._scratch

    def move(self, rates: tuple[float, ...], decay: Array, smoothness: float) -> None:
        """Adam's step; rates: of density and colour, and both corrections."""
        count = self._old.size
        kernels_gpu.copy_density.run(count, self.all, self._old)
        kernels_gpu.adam_step.run(
            count,
            self.all,
            self.gradient,
            self.touched,
            self._old,
            self.share,
            (*(float(rate) for rate in rates), float(smoothness)),
            gpu.to_gpu(decay),
        )
        self.touched.copy_to_device(np.zeros(self.touched.shape, np.bool_))


class GpuSteps(Steps):
    """`Steps` on a GPU."""

    def __init__(
        self, values: Array, share: Array, lower: NDArray[np.float64], voxel: float, params: VolumeParams
    ) -> None:
        self.params, self.lower, self.voxel = params, lower, voxel
        self._away = Grid(np.stack([values, np.zeros_like(values), np.zeros_like(values)]), share)
        self._lower, self._samples = gpu.to_gpu(lower), int(math.sqrt(3) * max(values.shape) / params.step) + 2

    def shade(self, rays: Rays, jitter: Array, background: Array) -> tuple[float, Array, Array]:
        count, params, away = len(jitter), self.params, self._away
        residual, transmittance = gpu.empty((count, 3)), gpu.empty(count)
        squares, scratch = gpu.zeros(SUMS, np.float64), away.scratch(count, self._samples)
        given = (rays.origins, rays.directions, jitter, rays.colours, background, rays.matte)
        kernels_gpu.shade.run(
            scratch[0].shape[1],
            tuple(gpu.to_gpu(array) for array in given),
            away.all[0],
            gpu.to_gpu(self._occupied),
            self._lower,
            (self.voxel, params.step * self.voxel),
            away.gradient,
            away.touched,
            residual,
            transmittance,
            (params.opacity_weight, params.binarisation_weight, params.matte_weight),
            squares,
            *scratch,
        )
        return float(squares.copy_to_host().sum()), residual.copy_to_host(), transmittance.copy_to_host()

    def move(self, rate: float, colour_rate: float, correct1: float, correct2: float) -> None:
        rates = rate, colour_rate, correct1, correct2
        self._away.move(rates, decays(self.params.betas), self.params.smoothness_weight)

    def values(self) -> Array:
        values: Array = self._away.all[0].copy_to_host()
        return values


class GpuRoom(Room):
    """`Room` on a GPU: its grid is there from the first look after a change until somebody asks for it."""

    _away: Grid | None = None
    _home: Array

    @property
    def step_length(self) -> float:
        return self.params.step * 4 / (int(self._home.shape[1]) - 1)

    @property
    def grid(self) -> Array:
        if self._away is not None:
            self._home, self._away = self._away.all.copy_to_host(), None
        return self._home

    @grid.setter
    def grid(self, values: Array) -> None:
        self._home, self._away = values, None

    def _go(self) -> Grid:
        if self._away is None:
            self._away = Grid(self._home, self._share)
        return self._away

    def _lengths(self) -> tuple[float, ...]:
        return self.radius, self.step_length, 4.0 / (self._home.shape[1] - 1), self.params.farthest

    def _see(self, origins: Array, directions: Array, jitter: Array) -> tuple[Array, Array]:
        rgb, through = gpu.zeros((len(origins), 3)), gpu.empty(len(origins))
        rays = [gpu.to_gpu(array) for array in (origins, directions, jitter)]
        kernels_gpu.look.run(len(origins), *rays, self._go().all[0], self._lengths(), rgb, through)
        return rgb.copy_to_host(), through.copy_to_host()

    def _splat(self, seen: Looked, slope: Array) -> None:
        away, count = self._go(), len(slope)
        given = (seen.origins, seen.directions, seen.jitter, seen.far, slope.astype(np.float32))
        rays, scratch = tuple(gpu.to_gpu(array) for array in given), away.scratch(count, int(8 / self.step_length))
        grids = away.gradient, away.touched
        kernels_gpu.splat.run(scratch[0].shape[1], rays, away.all[0], self._lengths(), *grids, *scratch)

    def _move(self, rates: tuple[float, ...]) -> None:
        self._go().move(rates, decays(self.params.betas), self.params.smoothness_weight)

    def _take_splatted(self) -> Array:
        gradient: Array = self._go().gradient.copy_to_host()[0]
        self.grid = self.grid  # the GPU's gradient goes
        return gradient
