"""Looking at a grid of density and colour: rays through it, outlines along a chart's rays, what lies near layers;
compiled, for `volume.py` and `outline.py` (tests/subject/test_volume.py).

`lower` is the place of voxel (0, 0, 0)'s centre, `voxel` a voxel's side, `step` the length of a step along a ray: all
in the scene's units.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from facefolds_core.kernels.jit import inlined, kernel

CLEAR, SPENT = 1e-4, 1e-3
"""Rays with less opacity than the first have no radii, and samples that are hidden have it as least weight, so that
hidden layers keep the colour of what is in them. Behind less transmittance than the second nothing is looked at."""


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
    """Optical depth across one voxel, and rgb, at voxel coordinates (x, y, z)."""
    i, j, k, fx, fy, fz = cell(grid, x, y, z)
    w = weights(fx, fy, fz)
    return (
        value(grid, i, j, k, w, 0),
        value(grid, i, j, k, w, 1),
        value(grid, i, j, k, w, 2),
        value(grid, i, j, k, w, 3),
    )


@inlined
def span(o, d, lower, voxel, grid):  # type: ignore[no-untyped-def]
    """Distances at which a ray enters and leaves the box of voxel centres; empty if the second is smaller."""
    near, far = 0.0, 1e30
    for a in range(3):
        slope = d[a] if abs(d[a]) > 1e-9 else 1e-9
        t0 = (lower[a] - o[a]) / slope
        t1 = (lower[a] + voxel * (grid.shape[a] - 1) - o[a]) / slope
        near = max(near, min(t0, t1))
        far = min(far, max(t0, t1))
    return near, far


@kernel(parallel=True)
def render(origins, directions, grid, lower, voxel, step):  # type: ignore[no-untyped-def]
    """(R, 3) rays -> rgb over black (R, 3), alpha (R,), distance where half of the light is left (R,) or 0."""
    count = origins.shape[0]
    rgb = np.zeros((count, 3), np.float32)
    alpha = np.zeros(count, np.float32)
    depth = np.zeros(count, np.float32)
    for r in prange(count):
        o, d = origins[r], directions[r]
        near, far = span(o, d, lower, voxel, grid)
        t, red, green, blue = np.float32(1.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
        s = near + 0.5 * step
        while s < far and t >= SPENT:
            x = (o[0] + s * d[0] - lower[0]) / voxel
            y = (o[1] + s * d[1] - lower[1]) / voxel
            z = (o[2] + s * d[2] - lower[2]) / voxel
            v0, v1, v2, v3 = sample(grid, x, y, z)
            a = np.float32(1 - math.exp(-v0 * step / voxel))
            red += t * a * v1
            green += t * a * v2
            blue += t * a * v3
            t *= 1 - a
            if depth[r] == 0 and t < 0.5:
                depth[r] = s
            s += step
        rgb[r, 0], rgb[r, 1], rgb[r, 2] = red, green, blue
        alpha[r] = 1 - t
    return rgb, alpha, depth


@kernel(parallel=True)
def profile(grid, lower, voxel, origins, directions, farthest, step, shares):  # type: ignore[no-untyped-def]
    """Along each ray, origins and directions (R, 3), from `farthest` in to the origin.

    Returns opacity (R,), colour over black (R, 3), and the radii (R, S) at which the given shares of the opacity are
    reached, linear between samples; 0 where all is clear.
    """
    count = directions.shape[0]
    samples = int(farthest / step)
    opacity = np.zeros(count, np.float32)
    rgb = np.zeros((count, 3), np.float32)
    radius = np.zeros((count, shares.shape[0]), np.float32)
    for r in prange(count):
        reached = np.zeros(samples + 1, np.float32)
        t = np.float32(1.0)
        for n in range(samples):
            s = farthest - (n + 0.5) * step
            x = (origins[r, 0] + s * directions[r, 0] - lower[0]) / voxel
            y = (origins[r, 1] + s * directions[r, 1] - lower[1]) / voxel
            z = (origins[r, 2] + s * directions[r, 2] - lower[2]) / voxel
            inside = min(x, y, z) >= 0 and x <= grid.shape[0] - 1 and y <= grid.shape[1] - 1 and z <= grid.shape[2] - 1
            if inside and t >= SPENT:
                v0, v1, v2, v3 = sample(grid, x, y, z)
                a = np.float32(1 - math.exp(-v0 * step / voxel))
                rgb[r, 0] += t * a * v1
                rgb[r, 1] += t * a * v2
                rgb[r, 2] += t * a * v3
                t *= 1 - a
            reached[n + 1] = 1 - t
        opacity[r] = 1 - t
        if opacity[r] < CLEAR:
            continue
        for k in range(shares.shape[0]):
            wanted = shares[k] * opacity[r]
            n = 1
            while n < samples and reached[n] < wanted:
                n += 1
            f = (wanted - reached[n - 1]) / max(reached[n] - reached[n - 1], np.float32(1e-9))
            radius[r, k] = farthest - (n - 1 + min(max(f, 0.0), 1.0)) * step
    return opacity, rgb, radius


@kernel(parallel=True)
def shells(grid, lower, voxel, origins, directions, radii, step, beyond):  # type: ignore[no-untyped-def]
    """Optical depth of the grid, shared out among layers: each sample among the two that it lies between.

    Along rays, origins and directions (R, 3), from `beyond` outside of the outermost of radii (R, N) to `beyond` inside
    of the innermost. Returns (R, N, 4): optical depth, and the colour of it that is seen from outside, 0 where there is
    none.
    """
    count, layers = radii.shape
    found = np.zeros((count, layers, 4), np.float32)
    for r in prange(count):
        near, s, light = 0, radii[r, 0] + beyond, 1.0
        seen = np.zeros(layers)
        while s > radii[r, layers - 1] - beyond:
            x = (origins[r, 0] + s * directions[r, 0] - lower[0]) / voxel
            y = (origins[r, 1] + s * directions[r, 1] - lower[1]) / voxel
            z = (origins[r, 2] + s * directions[r, 2] - lower[2]) / voxel
            inside = min(x, y, z) >= 0 and x <= grid.shape[0] - 1 and y <= grid.shape[1] - 1 and z <= grid.shape[2] - 1
            if inside:
                v0, v1, v2, v3 = sample(grid, x, y, z)
                while near < layers - 1 and s < radii[r, near + 1]:
                    near += 1
                share = 0.0
                if near < layers - 1 and s < radii[r, near]:
                    share = (radii[r, near] - s) / (radii[r, near] - radii[r, near + 1])
                depth = v0 * step / voxel
                weight = max(light, CLEAR) * (1 - math.exp(-depth))
                light *= math.exp(-depth)
                for k in range(near, min(near + 2, layers)):
                    part = 1 - share if k == near else share
                    found[r, k, 0] += depth * part
                    found[r, k, 1] += weight * part * v1
                    found[r, k, 2] += weight * part * v2
                    found[r, k, 3] += weight * part * v3
                    seen[k] += weight * part
            s -= step
        for k in range(layers):
            for c in range(1, 4):
                found[r, k, c] /= max(seen[k], 1e-12)
    return found
