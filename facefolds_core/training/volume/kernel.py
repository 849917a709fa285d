"""Rays through a grid of density and colour, forwards and backwards in one pass, and the grid's Adam step.

Compiled for CPUs; GPUs: `kernels_gpu.py`. Reference: `reference.py`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.jit import compiled, inlined, kernel
from facefolds_core.training.adam import EPSILON
from facefolds_core.training.volume.look_kernel import CLEAR, OPAQUE, span
from facefolds_core.training.volume.trilinear import cell, put, value, weights

Array = NDArray[Any]

PARTS = 8
"""Rays are shaded in this many parts, each with a gradient of its own: the result does not depend on the threads, of
which so many have work. Of a part's gradient only the rows (i, j) that it has touched are read."""

BLOCK = 4
"""Voxels a side of a block of the occupancy map."""

SIDE = np.uint64(BLOCK)

LIMIT = 12.0
"""Of |raw density|."""


def empty_gradient(shape: tuple[int, ...]) -> tuple[Array, NDArray[np.bool_]]:
    """Of a grid (X, Y, Z, 4): `gradient` and `touched` for `shade` and `adam_step`."""
    return np.zeros((PARTS, *shape), np.float32), np.zeros((PARTS, *shape[:2]), np.bool_)


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
    for part in prange(gradient.shape[0]):
        corner = np.empty((samples, 3), np.int32)
        fraction = np.empty((samples, 3), np.float32)
        colour = np.empty((samples, 3), np.float32)
        alpha = np.empty(samples, np.float32)
        slope = np.empty(samples, np.float32)
        before = np.empty(samples, np.float32)
        total = 0.0
        for r in range(count * part // gradient.shape[0], count * (part + 1) // gradient.shape[0]):
            total += shade_ray(
                r,
                (origins, directions, jitter, target, background, matte),
                grid,
                occupied,
                lower,
                (voxel, step),
                gradient[part],
                touched[part],
                residual,
                transmittance,
                (opacity_weight, binarisation_weight, matte_weight),
                (corner, fraction, colour, alpha, slope, before),
            )
        sums[part] = total
    total = 0.0  # not sums.sum(), which numba shares out among the threads
    for part in range(sums.shape[0]):
        total += sums[part]
    return total


@compiled
def shade_ray(
    r: Any,
    rays: Any,
    grid: Any,
    occupied: Any,
    lower: Any,
    lengths: Any,
    gradient: Any,
    touched: Any,
    residual: Any,
    transmittance: Any,
    prices: Any,
    kept: Any,
) -> Any:
    """`shade` of ray r into the gradient (X, Y, Z, 4) and touched (X, Y) of its part; returns |C - I|^2.

    rays, lengths and prices are arguments of `shade`. Scratch: kept, arrays of S samples, (S, 3) int32, twice (S, 3)
    and thrice (S,) float32.
    """
    origins, directions, jitter, target, background, matte = rays
    (voxel, step), (opacity_weight, binarisation_weight, matte_weight) = lengths, prices
    corner, fraction, colour, alpha, slope, before = kept
    one, density = np.float32(1.0), np.float32(step / voxel)
    o, d = origins[r], directions[r]
    near, far = span(o, d, lower, voxel, grid)
    x0, y0, z0 = (o[0] - lower[0]) / voxel, (o[1] - lower[1]) / voxel, (o[2] - lower[2]) / voxel
    dx, dy, dz = d[0] / voxel, d[1] / voxel, d[2] / voxel
    c0, c1, c2, t = np.float32(0.0), np.float32(0.0), np.float32(0.0), one
    m = 0
    s = near + jitter[r] * step
    while s < far and m < corner.shape[0] and t >= OPAQUE:
        i, j, k, fx, fy, fz = cell(grid, x0 + s * dx, y0 + s * dy, z0 + s * dz)
        s += step
        if not occupied[i // SIDE, j // SIDE, k // SIDE]:
            continue
        w = weights(fx, fy, fz)
        # exp(-softplus(raw) density) and its slope from one exponential; beyond 15 softplus is its argument.
        e = math.exp(min(value(grid, i, j, k, w, 0), np.float32(15.0)))
        rest = math.exp(-math.log1p(e) * density)
        a = np.float32(one - rest)
        if a < CLEAR:
            continue
        v1, v2, v3 = value(grid, i, j, k, w, 1), value(grid, i, j, k, w, 2), value(grid, i, j, k, w, 3)
        corner[m, 0], corner[m, 1], corner[m, 2] = i, j, k
        fraction[m, 0], fraction[m, 1], fraction[m, 2] = fx, fy, fz
        colour[m, 0], colour[m, 1], colour[m, 2] = v1, v2, v3
        alpha[m], slope[m], before[m] = a, rest * density * (e / (one + e)), t
        c0 += t * a * v1
        c1 += t * a * v2
        c2 += t * a * v3
        t *= one - a
        m += 1
    transmittance[r] = t
    b0, b1, b2 = background[r, 0], background[r, 1], background[r, 2]
    d0, d1, d2 = c0 + t * b0 - target[r, 0], c1 + t * b1 - target[r, 1], c2 + t * b2 - target[r, 2]
    residual[r, 0], residual[r, 1], residual[r, 2] = d0, d1, d2
    # From the back: b is the colour, `after` the transmittance of all that lies behind sample n.
    push = np.float32(opacity_weight - binarisation_weight * max(one - 2 * t, np.float32(0.0)))
    if matte[r] >= 0:
        push += np.float32(matte_weight) * (one - t - matte[r])
    after = one
    for n in range(m - 1, -1, -1):
        a, light = alpha[n], before[n]
        g0, g1, g2 = colour[n, 0] - b0, colour[n, 1] - b1, colour[n, 2] - b2
        pull = push * after + d0 * g0 + d1 * g1 + d2 * g2
        b0, b1, b2 = b0 + a * g0, b1 + a * g1, b2 + a * g2
        after *= one - a
        w = weights(fraction[n, 0], fraction[n, 1], fraction[n, 2])
        wish = (light * pull * slope[n], light * a * d0, light * a * d1, light * a * d2)
        put(gradient, touched, np.uint64(corner[n, 0]), np.uint64(corner[n, 1]), np.uint64(corner[n, 2]), w, wish)
    return d0 * d0 + d1 * d1 + d2 * d2


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
    old = grid[0, ..., 0].copy()
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
                adam_voxel(
                    i,
                    j,
                    k,
                    grid,
                    gradient,
                    old,
                    share,
                    (rate_density, rate_colour, correct1, correct2, smooth),
                    decay,
                    parts[:count],
                    total,
                )


@inlined  # a call with so many arrays costs
def adam_voxel(
    i: Any,
    j: Any,
    k: Any,
    grid: Any,
    gradient: Any,
    old: Any,
    share: Any,
    rates: Any,
    decay: Any,
    parts: Any,
    total: Any,
) -> None:
    """`adam_step` of a voxel: old (X, Y, Z) raw densities before it, parts (P,) of the gradient that may have something
    for it; rates are arguments of `adam_step`. Scratch: total (4,)."""
    rate_density, rate_colour, correct1, correct2, smooth = rates
    nx, ny, nz = old.shape
    for q in range(4):
        total[q] = 0
    met = False
    for c in range(parts.shape[0]):
        own = gradient[parts[c], i, j, k]
        met = met or own[0] != 0
        for q in range(4):
            total[q] += own[q]
            own[q] = 0
    if not met:
        return
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
        moved = grid[0, i, j, k, q] - rate * (m1 * correct1) / (math.sqrt(m2 * correct2) + EPSILON)
        low, high = (-LIMIT, LIMIT) if q == 0 else (0.0, 1.0)
        grid[0, i, j, k, q] = min(max(moved, low), high)
