"""Rays through a grid of density and colour, forwards and backwards in one pass, and the grid's Adam step.

Compiled for CPUs; GPUs: `kernels_gpu.py`. Reference: `reference.py`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.jit import add, compiled, inlined, kernel
from facefolds_core.training.adam import EPSILON
from facefolds_core.training.volume.look_kernel import CLEAR, OPAQUE, sample, softplus, span

Array = NDArray[Any]

PARTS = 8
"""Rays are shaded in this many parts, each with a gradient of its own: the result does not depend on the threads, of
which so many have work. Of a part's gradient only the rows (i, j) that it has touched are read."""

BLOCK = 4
"""Voxels a side of a block of the occupancy map."""

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
        value, c, behind = np.empty(4, np.float32), np.empty(3, np.float32), np.empty(3, np.float32)
        total = 0.0
        for r in range(count * part // gradient.shape[0], count * (part + 1) // gradient.shape[0]):
            total = shade_ray(
                total,
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
                (value, c, behind),
            )
        sums[part] = total
    total = 0.0  # not sums.sum(), which numba shares out among the threads
    for part in range(sums.shape[0]):
        total += sums[part]
    return total


@compiled
def shade_ray(
    total: Any,
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
    weights: Any,
    kept: Any,
    own: Any,
) -> Any:
    """`shade` of ray r into the gradient (X, Y, Z, 4) and touched (X, Y) of its part; returns `total` and |C - I|^2.

    rays, lengths and weights are arguments of `shade`. Scratch: kept, arrays of S samples, (S, 3) int32, twice (S, 3)
    and thrice (S,) float32; own, arrays (4,), (3,) and (3,).
    """
    origins, directions, jitter, target, background, matte = rays
    (voxel, step), (opacity_weight, binarisation_weight, matte_weight) = lengths, weights
    (corner, fraction, colour, alpha, slope, before), (value, c, behind) = kept, own
    density = step / voxel
    o, d = origins[r], directions[r]
    near, far = span(o, d, lower, voxel, grid)
    for q in range(3):
        c[q] = 0
    t = np.float32(1.0)
    m = 0
    s = near + jitter[r] * step
    while s < far and m < corner.shape[0] and t >= OPAQUE:
        x = (o[0] + s * d[0] - lower[0]) / voxel
        y = (o[1] + s * d[1] - lower[1]) / voxel
        z = (o[2] + s * d[2] - lower[2]) / voxel
        s += step
        if not occupied[int(max(x, 0.0)) // BLOCK, int(max(y, 0.0)) // BLOCK, int(max(z, 0.0)) // BLOCK]:
            continue
        i, j, k, fx, fy, fz = sample(grid, x, y, z, value)
        rest = math.exp(-softplus(value[0]) * density)
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
        place = (corner[n, 0], corner[n, 1], corner[n, 2], fraction[n, 0], fraction[n, 1], fraction[n, 2])
        put(place, light * pull * slope[n], light, a, residual[r], gradient, touched)
    return total


@inlined
def put(place, g, light, a, slope, gradient, touched):  # type: ignore[no-untyped-def]
    """Add a sample's wishes at its eight voxels: g of raw density, light a slope (3,) of colour; say so in touched."""
    i, j, k, fx, fy, fz = place
    for tap in range(4):
        touched[i + (tap >> 1), j + (tap & 1)] = True
    for tap in range(8):
        di, dj, dk = tap >> 2, (tap >> 1) & 1, tap & 1
        w = (fx if di else 1 - fx) * (fy if dj else 1 - fy) * (fz if dk else 1 - fz)
        add(gradient, (i + di, j + dj, k + dk, 0), w * g)
        for q in range(3):
            add(gradient, (i + di, j + dj, k + dk, q + 1), w * light * a * slope[q])


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
