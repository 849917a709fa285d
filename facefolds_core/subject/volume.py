"""The subject as a grid of density and colour: what asks along rays of a chart, from inside, needs no Gaussians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.subject import look_kernel
from facefolds_core.subject.splats import TURN, Splats
from facefolds_core.subject.voxels_kernel import deposit

Array = NDArray[np.float32]

STEP = 0.7
"""Between samples on a ray, voxels."""
CELLS, COARSE = 160, 96
"""Voxels along the longest side; and where a chart is chosen, which many are asked for."""
OUTSIDE = 0.002
"""Share of the Gaussians that may lie outside of the box on each side."""
MARGIN = 0.02
"""Around the others, units."""
REACH = 3.0
"""Standard deviations within which a Gaussian leaves something in a voxel."""
BLUR = 0.5
"""Standard deviation by which each is blurred, voxels: what is thinner than a voxel stays."""
WIDEST = 0.995
"""Largest opacity of a Gaussian: more would be an endless optical depth."""


@dataclass(frozen=True)
class Volume:
    """Density and colour on a grid.

    Attributes:
        grid: (X, Y, Z, 4) optical depth of a voxel and rgb, linear between voxels.
        lower: (3,) position of voxel (0, 0, 0), units.
        voxel: its side, units.
    """

    grid: Array
    lower: NDArray[np.float64]
    voxel: float

    def render(self, origins: Array, directions: Array) -> tuple[Array, Array, Array]:
        """Rays (R, 3) -> rgb over black (R, 3), alpha (R,), distance at which T falls to 1/2 or 0 (R,)."""
        rgb, alpha, depth = look_kernel.render(
            np.ascontiguousarray(origins, np.float32),
            np.ascontiguousarray(directions, np.float32),
            self.grid,
            self.lower,
            self.voxel,
            STEP * self.voxel,
        )
        return rgb, alpha, depth


def volume_of(splats: Splats, cells: int = CELLS, finest: float = 0.0) -> Volume:
    """Gaussians as a grid with so many voxels along its longest side, fewer where they would be smaller than `finest`.

    A Gaussian of largest opacity o has an optical depth of -log(1 - o) along a ray through its middle and across its
    face. Spread over its volume this is a density of -log(1 - o) 2 pi s1 s2 N(x; S + (BLUR voxel)^2 I), s1 and s2 its
    two greater standard deviations.
    """
    low, high = (edge.astype(np.float64) for edge in np.quantile(splats.means, [OUTSIDE, 1 - OUTSIDE], axis=0))
    low, high = low - MARGIN, high + MARGIN
    voxel = max(finest, float((high - low).max()) / (cells - 1))
    shape = tuple(int(n) for n in np.ceil((high - low) / voxel) + 1)
    sizes, opacities = splats.sizes.astype(np.float64), np.minimum(splats.opacities.astype(np.float64), WIDEST)
    mass = -np.log1p(-opacities) * 2 * np.pi * np.prod(np.sort(sizes, 1)[:, 1:], 1)
    grid = np.zeros((*shape, 4), np.float32)
    turns, colours = splats.values[:, TURN].astype(np.float64), np.clip(splats.colours, 0, 1).astype(np.float64)
    deposit(splats.means.astype(np.float64), sizes, turns, mass, colours, low, voxel, BLUR * voxel, REACH, grid)
    grid[..., 1:] /= np.maximum(grid[..., :1], np.float32(1e-12))
    grid[..., 0] *= np.float32(voxel)
    return Volume(grid, low, voxel)
