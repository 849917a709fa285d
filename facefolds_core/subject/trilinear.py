"""Trilinear values of a grid of density and colour, compiled."""

from __future__ import annotations

import numpy as np

from facefolds_core.kernels.jit import inlined


@inlined
def cell(grid, x, y, z):  # type: ignore[no-untyped-def]
    """Lower corner (uint64) and fractions (float32) of voxel coordinates (x, y, z), clamped to the grid.

    Voxels are numbered without a sign: numba then need not ask whether an index counts from the end.
    """
    i = max(min(int(x), grid.shape[0] - 2), 0)
    j = max(min(int(y), grid.shape[1] - 2), 0)
    k = max(min(int(z), grid.shape[2] - 2), 0)
    fx = np.float32(min(max(x - i, 0.0), 1.0))
    fy = np.float32(min(max(y - j, 0.0), 1.0))
    fz = np.float32(min(max(z - k, 0.0), 1.0))
    return np.uint64(i), np.uint64(j), np.uint64(k), fx, fy, fz


@inlined
def weights(fx, fy, fz):  # type: ignore[no-untyped-def]
    """Of the eight voxels around a point, the last axis first."""
    one = np.float32(1.0)
    gx, gy, gz = one - fx, one - fy, one - fz
    a, b, c, d = gx * gy, gx * fy, fx * gy, fx * fy
    return a * gz, a * fz, b * gz, b * fz, c * gz, c * fz, d * gz, d * fz


@inlined
def value(grid, i, j, k, w, q):  # type: ignore[no-untyped-def]
    """Channel q of grid (X, Y, Z, 4) in the cell (i, j, k), at the point of weights w."""
    i1, j1, k1 = i + np.uint64(1), j + np.uint64(1), k + np.uint64(1)
    return (
        w[0] * grid[i, j, k, q]
        + w[1] * grid[i, j, k1, q]
        + w[2] * grid[i, j1, k, q]
        + w[3] * grid[i, j1, k1, q]
        + w[4] * grid[i1, j, k, q]
        + w[5] * grid[i1, j, k1, q]
        + w[6] * grid[i1, j1, k, q]
        + w[7] * grid[i1, j1, k1, q]
    )


@inlined
def sample(grid, x, y, z):  # type: ignore[no-untyped-def]
    """Optical depth and rgb at voxel coordinates (x, y, z)."""
    i, j, k, fx, fy, fz = cell(grid, x, y, z)
    w = weights(fx, fy, fz)
    return (
        value(grid, i, j, k, w, 0),
        value(grid, i, j, k, w, 1),
        value(grid, i, j, k, w, 2),
        value(grid, i, j, k, w, 3),
    )
