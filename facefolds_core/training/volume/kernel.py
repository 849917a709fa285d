"""Rays through a grid of density and colour, forwards and backwards in one pass, and the grid's Adam step.

Compiled for CPUs. Reference: `reference.py`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.jit import inlined, kernel
from facefolds_core.training.adam import EPSILON

Array = NDArray[Any]

PARTS = 8
"""Rays are shaded in this many parts, each with a gradient of its own: the result does not depend on the threads, of
which so many have work. Of a part's gradient only the rows (i, j) that it has touched are read."""

BLOCK = 4
"""Voxels a side of a block of the occupancy map."""

CLEAR, OPAQUE = 1e-4, 1e-3
"""Samples with less alpha are left out, and so is what lies behind less transmittance."""

LIMIT = 12.0
"""Of |raw density|."""


def empty_gradient(shape: tuple[int, ...]) -> tuple[Array, NDArray[np.bool_]]:
    """Of a grid (X, Y, Z, 4): `gradient` and `touched` for `shade` and `adam_step`."""
    return np.zeros((PARTS, *shape), np.float32), np.zeros((PARTS, *shape[:2]), np.bool_)


@inlined
def _softplus(x):  # type: ignore[no-untyped-def]
    return x if x > 15.0 else math.log1p(math.exp(x))


@inlined
def _span(o, d, lower, voxel, grid):  # type: ignore[no-untyped-def]
    """Distances at which a ray enters and leaves the box of voxel centres; empty if the second is smaller."""
    near, far = 0.0, 1e30
    for a in range(3):
        slope = d[a] if abs(d[a]) > 1e-9 else 1e-9
        t0 = (lower[a] - o[a]) / slope
        t1 = (lower[a] + voxel * (grid.shape[a] - 1) - o[a]) / slope
        near = max(near, min(t0, t1))
        far = min(far, max(t0, t1))
    return near, far


@inlined
def _sample(grid, x, y, z, out):  # type: ignore[no-untyped-def]
    """Trilinear values at voxel coordinates (x, y, z) into out[0:4]; returns the lower corner and the fractions."""
    i = min(max(int(x), 0), grid.shape[0] - 2)
    j = min(max(int(y), 0), grid.shape[1] - 2)
    k = min(max(int(z), 0), grid.shape[2] - 2)
    fx = np.float32(min(max(x - i, 0.0), 1.0))
    fy = np.float32(min(max(y - j, 0.0), 1.0))
    fz = np.float32(min(max(z - k, 0.0), 1.0))
    for q in range(4):
        out[q] = 0
    for t in range(8):
        di, dj, dk = t >> 2, (t >> 1) & 1, t & 1
        w = (fx if di else 1 - fx) * (fy if dj else 1 - fy) * (fz if dk else 1 - fz)
        for q in range(4):
            out[q] += w * grid[i + di, j + dj, k + dk, q]
    return i, j, k, fx, fy, fz


@kernel(parallel=True)
def shade(  # type: ignore[no-untyped-def]
    origins,  # (R, 3) float32
    directions,  # (R, 3) float32, unit
    jitter,  # (R,) float32 in [0, 1): where in the first step the first sample lies
    target,  # (R, 3) float32 in [0, 1]
    background,  # (R, 3) float32
    matte,  # (R,) float32: opacity of the subject, or -1 where it is not known
    grid,  # (X, Y, Z, 4) float32: raw density, rgb
    occupied,  # (X / BLOCK, ...) bool, rounded up: blocks that may hold something
    lower,  # (3,) position of voxel (0, 0, 0)
    voxel,  # its side, units
    step,  # between samples, units
    samples,  # at most so many on a ray
    gradient,  # (PARTS, X, Y, Z, 4), added to
    touched,  # (PARTS, X, Y) bool, set where the gradient is added to
    residual,  # (R, 3) out: C - I
    transmittance,  # (R,) out: transmittance
    opacity_weight,  # weight of opacity
    binarisation_weight,  # weight of rays that are nearly, but not quite, opaque
    matte_weight,  # weight of the squared distance from a known opacity
):
    """Differentiates the sum over rays of 0.5 |C - I|^2 + opacity_weight (1 - T) + binarisation_weight t (1 - t)
    + 0.5 matte_weight (1 - T - A)^2.

    T is the transmittance, t = min(T, 1/2), A the matte; without one the last term is 0.

    A sample has alpha = 1 - exp(-softplus(raw) step / voxel). Returns the sum of |C - I|^2.
    """
    count = origins.shape[0]
    sums = np.zeros(gradient.shape[0])
    density = step / voxel
    for part in prange(gradient.shape[0]):
        own = gradient[part]
        corner = np.empty((samples, 3), np.int32)
        fraction = np.empty((samples, 3), np.float32)
        colour = np.empty((samples, 3), np.float32)
        alpha = np.empty(samples, np.float32)
        slope = np.empty(samples, np.float32)
        before = np.empty(samples, np.float32)
        value = np.empty(4, np.float32)
        total = 0.0
        for r in range(count * part // gradient.shape[0], count * (part + 1) // gradient.shape[0]):
            o, d = origins[r], directions[r]
            near, far = _span(o, d, lower, voxel, grid)
            c = np.zeros(3, np.float32)
            t = np.float32(1.0)
            m = 0
            s = near + jitter[r] * step
            while s < far and m < samples and t >= OPAQUE:
                x = (o[0] + s * d[0] - lower[0]) / voxel
                y = (o[1] + s * d[1] - lower[1]) / voxel
                z = (o[2] + s * d[2] - lower[2]) / voxel
                s += step
                if not occupied[int(max(x, 0.0)) // BLOCK, int(max(y, 0.0)) // BLOCK, int(max(z, 0.0)) // BLOCK]:
                    continue
                i, j, k, fx, fy, fz = _sample(grid, x, y, z, value)
                rest = math.exp(-_softplus(value[0]) * density)
                a = np.float32(1 - rest)
                if a < CLEAR:
                    continue
                corner[m, 0], corner[m, 1], corner[m, 2] = i, j, k
                fraction[m, 0], fraction[m, 1], fraction[m, 2] = fx, fy, fz
                alpha[m] = a
                slope[m] = rest * density / (1 + math.exp(-value[0]))
                before[m] = t
                for q in range(3):
                    colour[m, q] = value[q + 1]
                    c[q] += t * a * value[q + 1]
                t *= 1 - a
                m += 1
            transmittance[r] = t
            behind = np.empty(3, np.float32)
            for q in range(3):
                behind[q] = background[r, q]
                residual[r, q] = c[q] + t * background[r, q] - target[r, q]
                total += residual[r, q] * residual[r, q]
            # From the back: `behind` is the colour, `after` the transmittance of all that lies behind sample n.
            push = np.float32(opacity_weight - binarisation_weight * max(1 - 2 * t, np.float32(0.0)))
            if matte[r] >= 0:
                push += np.float32(matte_weight) * (1 - t - matte[r])
            after = np.float32(1.0)
            for n in range(m - 1, -1, -1):
                a, light = alpha[n], before[n]
                pull = push * after
                for q in range(3):
                    pull += residual[r, q] * (colour[n, q] - behind[q])
                    behind[q] = a * colour[n, q] + (1 - a) * behind[q]
                after *= 1 - a
                g = light * pull * slope[n]
                i, j, k = corner[n, 0], corner[n, 1], corner[n, 2]
                fx, fy, fz = fraction[n, 0], fraction[n, 1], fraction[n, 2]
                for tap in range(4):
                    touched[part, i + (tap >> 1), j + (tap & 1)] = True
                for tap in range(8):
                    di, dj, dk = tap >> 2, (tap >> 1) & 1, tap & 1
                    w = (fx if di else 1 - fx) * (fy if dj else 1 - fy) * (fz if dk else 1 - fz)
                    own[i + di, j + dj, k + dk, 0] += w * g
                    for q in range(3):
                        own[i + di, j + dj, k + dk, q + 1] += w * light * a * residual[r, q]
        sums[part] = total
    total = 0.0  # not sums.sum(), which numba shares out among the threads
    for part in range(sums.shape[0]):
        total += sums[part]
    return total


@kernel(parallel=True)
def render(origins, directions, grid, lower, voxel, step):  # type: ignore[no-untyped-def]
    """(R, 3) rays -> rgb over black (R, 3), alpha (R,), distance where half of the light is left (R,) or 0."""
    count = origins.shape[0]
    rgb = np.zeros((count, 3), np.float32)
    alpha = np.zeros(count, np.float32)
    depth = np.zeros(count, np.float32)
    for r in prange(count):
        o, d = origins[r], directions[r]
        near, far = _span(o, d, lower, voxel, grid)
        value = np.empty(4, np.float32)
        t = np.float32(1.0)
        s = near + 0.5 * step
        while s < far and t >= OPAQUE:
            x = (o[0] + s * d[0] - lower[0]) / voxel
            y = (o[1] + s * d[1] - lower[1]) / voxel
            z = (o[2] + s * d[2] - lower[2]) / voxel
            _sample(grid, x, y, z, value)
            a = np.float32(1 - math.exp(-_softplus(value[0]) * step / voxel))
            for q in range(3):
                rgb[r, q] += t * a * value[q + 1]
            t *= 1 - a
            if depth[r] == 0 and t < 0.5:
                depth[r] = s
            s += step
        alpha[r] = 1 - t
    return rgb, alpha, depth


@kernel(parallel=True)
def adam_step(  # type: ignore[no-untyped-def]
    grid,  # (3, X, Y, Z, 4): values, first and second moments; all updated in place
    gradient,  # (PARTS, X, Y, Z, 4); zero afterwards
    touched,  # (PARTS, X, Y) bool; False afterwards
    share,  # (X, Y, Z) factor on the rate of density
    rate_density,
    rate_colour,
    correct1,  # `adam.corrections`
    correct2,
    decay,  # `adam.decays`
    smooth,  # weight of sum sqrt(1 + d^2) over differences d of raw density to the six neighbours
):
    """Adam on the voxels that the rays have met; the others stay as they are, moments included."""
    values = grid[0]
    old = values[..., 0].copy()
    nx, ny, nz = old.shape
    for i in prange(nx):
        parts = np.empty(gradient.shape[0], np.int64)
        total = np.empty(4, np.float32)
        for j in range(ny):
            count = 0
            for part in range(gradient.shape[0]):
                if touched[part, i, j]:
                    touched[part, i, j] = False
                    parts[count] = part
                    count += 1
            if count == 0:
                continue
            for k in range(nz):
                total[:] = 0
                met = False
                for c in range(count):
                    own = gradient[parts[c], i, j, k]
                    met = met or own[0] != 0
                    for q in range(4):
                        total[q] += own[q]
                        own[q] = 0
                if not met:
                    continue
                for q in range(4):
                    g = total[q]
                    if q == 0:
                        for n in range(6):
                            a, b = n >> 1, 2 * (n & 1) - 1
                            x, y, z = i + (b if a == 0 else 0), j + (b if a == 1 else 0), k + (b if a == 2 else 0)
                            if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
                                difference = old[i, j, k] - old[x, y, z]
                                g += np.float32(smooth) * difference / math.sqrt(1 + difference * difference)
                    m1 = decay[0] * grid[1, i, j, k, q] + decay[1] * g
                    m2 = decay[2] * grid[2, i, j, k, q] + decay[3] * g * g
                    grid[1, i, j, k, q], grid[2, i, j, k, q] = m1, m2
                    rate = rate_density * share[i, j, k] if q == 0 else rate_colour
                    moved = values[i, j, k, q] - rate * (m1 * correct1) / (math.sqrt(m2 * correct2) + EPSILON)
                    low, high = (-LIMIT, LIMIT) if q == 0 else (0.0, 1.0)
                    values[i, j, k, q] = min(max(moved, low), high)


@kernel(parallel=True)
def profile(grid, lower, voxel, centre, directions, farthest, step, shares):  # type: ignore[no-untyped-def]
    """Along each direction (R, 3), from `farthest` in to `centre`.

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
        value = np.empty(4, np.float32)
        t = np.float32(1.0)
        for n in range(samples):
            s = farthest - (n + 0.5) * step
            x = (centre[0] + s * directions[r, 0] - lower[0]) / voxel
            y = (centre[1] + s * directions[r, 1] - lower[1]) / voxel
            z = (centre[2] + s * directions[r, 2] - lower[2]) / voxel
            inside = min(x, y, z) >= 0 and x <= grid.shape[0] - 1 and y <= grid.shape[1] - 1 and z <= grid.shape[2] - 1
            if inside and t >= OPAQUE:
                _sample(grid, x, y, z, value)
                a = np.float32(1 - math.exp(-_softplus(value[0]) * step / voxel))
                for q in range(3):
                    rgb[r, q] += t * a * value[q + 1]
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
