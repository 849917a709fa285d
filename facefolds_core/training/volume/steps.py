"""One step of the volume's fit after the other, on a CPU."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.params import VolumeParams
from facefolds_core.training.adam import decays
from facefolds_core.training.volume import kernel

if TYPE_CHECKING:
    from facefolds_core.training.volume.optimise import Rays

Array = NDArray[np.float32]


def occupied_blocks(density: Array, empty_depth: float) -> NDArray[np.bool_]:
    """Blocks that hold, or touch, a voxel that is not empty."""
    block = kernel.BLOCK
    blocks = tuple(n // block + 1 for n in density.shape)
    padded = np.full([block * n for n in blocks], -kernel.LIMIT, np.float32)
    padded[tuple(slice(n) for n in density.shape)] = ndimage.maximum_filter(density, 3)
    split = padded.reshape(blocks[0], block, blocks[1], block, blocks[2], block)
    found: NDArray[np.bool_] = split.max((1, 3, 5)) > math.log(math.expm1(empty_depth))
    return found


def shade(
    grid: Array,
    occupied: NDArray[np.bool_],
    lower: NDArray[np.float64],
    voxel: float,
    rays: Rays,
    jitter: Array,
    background: Array,
    gradient: Array,
    touched: NDArray[np.bool_],
    step: float,
    opacity_weight: float,
    binarisation_weight: float,
    matte_weight: float,
) -> tuple[float, Array, Array]:
    """`kernel.shade` with steps of so many voxels: sum of |C - I|^2, residuals (R, 3), transmittance (R,)."""
    residual, transmittance = np.empty_like(rays.colours), np.empty(len(rays.colours), np.float32)
    samples = int(math.sqrt(3) * max(grid.shape) / step) + 2
    squares: float = kernel.shade(
        rays.origins,
        rays.directions,
        jitter,
        rays.colours,
        background,
        rays.matte,
        grid,
        occupied,
        lower,
        voxel,
        step * voxel,
        samples,
        gradient,
        touched,
        residual,
        transmittance,
        opacity_weight,
        binarisation_weight,
        matte_weight,
    )
    return squares, residual, transmittance


class Steps:
    """A grid (X, Y, Z, 4) that is fitted, with Adam's moments.

    Args:
        values: to start with.
        share: (X, Y, Z) factor on the rate of density.
        lower, voxel: place and size of the grid, as in `Volume`.
        params: of the fit.
    """

    def __init__(
        self, values: Array, share: Array, lower: NDArray[np.float64], voxel: float, params: VolumeParams
    ) -> None:
        self.params, self.share, self.lower, self.voxel = params, share, lower, voxel
        self._grid = np.stack([values, np.zeros_like(values), np.zeros_like(values)])
        self._gradient, self._touched = kernel.empty_gradient(values.shape)

    def occupy(self) -> None:
        """Look again at which blocks hold something."""
        self._occupied = occupied_blocks(self.values()[..., 0], self.params.empty_depth)

    def shade(self, rays: Rays, jitter: Array, background: Array) -> tuple[float, Array, Array]:
        """Add the gradient of rays over what is behind them (R, 3): sum of |C - I|^2, residuals (R, 3), T (R,)."""
        params = self.params
        return shade(
            self._grid[0],
            self._occupied,
            self.lower,
            self.voxel,
            rays,
            jitter,
            background,
            self._gradient,
            self._touched,
            params.step,
            params.opacity_weight,
            params.binarisation_weight,
            params.matte_weight,
        )

    def move(self, rate: float, colour_rate: float, correct1: float, correct2: float) -> None:
        """Adam's step; see `kernel.adam_step`."""
        rates = rate, colour_rate, correct1, correct2
        decay, smoothness = decays(self.params.betas), self.params.smoothness_weight
        kernel.adam_step(self._grid, self._gradient, self._touched, self.share, *rates, decay, smoothness)

    def values(self) -> Array:
        """(X, Y, Z, 4) as they are now."""
        values: Array = self._grid[0]
        return values


def steps_type(gpu: bool) -> type[Steps]:
    """The class whose steps run there."""
    if not gpu:
        return Steps
    from facefolds_core.training.volume.steps_gpu import GpuSteps

    return GpuSteps
