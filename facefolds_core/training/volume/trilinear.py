"""Trilinear values of a grid of density and colour, and what is wanted at a point put to its eight voxels: compiled.

What is read comes back as numbers, not in an array: for all a compiler knows, an array that is written between two
reads may be the grid, so that it keeps eight additions in line that could run side by side (half of a step)."""

from __future__ import annotations

from typing import Any

import numpy as np

from facefolds_core.jit import add4, inlined


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
    """Raw density and rgb at voxel coordinates (x, y, z)."""
    i, j, k, fx, fy, fz = cell(grid, x, y, z)
    w = weights(fx, fy, fz)
    return (
        value(grid, i, j, k, w, 0),
        value(grid, i, j, k, w, 1),
        value(grid, i, j, k, w, 2),
        value(grid, i, j, k, w, 3),
    )


@inlined
def put(gradient: Any, touched: Any, i: Any, j: Any, k: Any, w: Any, g: Any) -> None:
    """Add g, of raw density and rgb, to the voxels of the cell (i, j, k) by the weights w; say so in touched (X, Y)."""
    i1, j1, k1 = i + np.uint64(1), j + np.uint64(1), k + np.uint64(1)
    touched[i, j], touched[i, j1], touched[i1, j], touched[i1, j1] = True, True, True, True
    g0, g1, g2, g3 = g
    add4(gradient, (i, j, k), w[0] * g0, w[0] * g1, w[0] * g2, w[0] * g3)
    add4(gradient, (i, j, k1), w[1] * g0, w[1] * g1, w[1] * g2, w[1] * g3)
    add4(gradient, (i, j1, k), w[2] * g0, w[2] * g1, w[2] * g2, w[2] * g3)
    add4(gradient, (i, j1, k1), w[3] * g0, w[3] * g1, w[3] * g2, w[3] * g3)
    add4(gradient, (i1, j, k), w[4] * g0, w[4] * g1, w[4] * g2, w[4] * g3)
    add4(gradient, (i1, j, k1), w[5] * g0, w[5] * g1, w[5] * g2, w[5] * g3)
    add4(gradient, (i1, j1, k), w[6] * g0, w[6] * g1, w[6] * g2, w[6] * g3)
    add4(gradient, (i1, j1, k1), w[7] * g0, w[7] * g1, w[7] * g2, w[7] * g3)
