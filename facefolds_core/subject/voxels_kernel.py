"""Densities of Gaussians, compiled."""

from __future__ import annotations

import math

import numpy as np

from facefolds_core.kernels.jit import kernel
from facefolds_core.subject.project_kernel import turned


@kernel()
def deposit(means, sizes, turns, mass, colours, lower, voxel, soft, reach, grid):  # type: ignore[no-untyped-def]
    """Add the densities of N Gaussians, and colours times densities, to grid (X, Y, Z, 4).

    Args:
        mass: (N,) integral of each density.
        soft: standard deviation of the blur, units.
    """
    r = np.zeros((3, 3))
    for n in range(means.shape[0]):
        turned(turns[n], r)
        v0, v1, v2 = sizes[n, 0] ** 2 + soft * soft, sizes[n, 1] ** 2 + soft * soft, sizes[n, 2] ** 2 + soft * soft
        scale = mass[n] / math.sqrt((2 * math.pi) ** 3 * v0 * v1 * v2)
        low, high = [0, 0, 0], [0, 0, 0]
        for a in range(3):
            half = reach * math.sqrt(r[a, 0] ** 2 * v0 + r[a, 1] ** 2 * v1 + r[a, 2] ** 2 * v2)
            low[a] = max(0, math.ceil((means[n, a] - half - lower[a]) / voxel))
            high[a] = min(grid.shape[a] - 1, math.floor((means[n, a] + half - lower[a]) / voxel))
        for i in range(low[0], high[0] + 1):
            dx = lower[0] + i * voxel - means[n, 0]
            for j in range(low[1], high[1] + 1):
                dy = lower[1] + j * voxel - means[n, 1]
                for k in range(low[2], high[2] + 1):
                    dz = lower[2] + k * voxel - means[n, 2]
                    p = r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz
                    q = r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz
                    s = r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz
                    power = 0.5 * (p * p / v0 + q * q / v1 + s * s / v2)
                    if power < 0.5 * reach * reach:
                        density = scale * math.exp(-power)
                        grid[i, j, k, 0] += density
                        for c in range(3):
                            grid[i, j, k, 1 + c] += density * colours[n, c]
