"""Rays through the outer zone, all space beyond a ball, contracted to a finite grid: forwards, and backwards.

A point y, in radii of the ball, lies in the grid at y for |y| < 1 and at (2 - 1/|y|) y/|y| beyond, as in mip-NeRF 360:
voxels grow with distance, and infinity is a sphere of radius 2. Steps along a ray have one length in the contracted
space. Only what lies behind a ray's point nearest to the ball's centre is looked at: cameras see the subject freely.

Compiled for CPUs; GPUs: `kernels_gpu.py`. Reference: `room_reference.py`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from facefolds_core.jit import compiled, inlined, kernel
from facefolds_core.training.volume.look_kernel import CLEAR, OPAQUE, softplus
from facefolds_core.training.volume.trilinear import cell, put, sample, value, weights


@inlined
def _start(o, d, radius):  # type: ignore[no-untyped-def]
    """Distance at which a ray leaves the ball; its point nearest to the centre, or its own start, if it misses it."""
    nearest = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2])
    inside = nearest * nearest - (o[0] * o[0] + o[1] * o[1] + o[2] * o[2]) + radius * radius
    return max(nearest + math.sqrt(max(inside, 0.0)), 0.0)


@inlined
def _stride(o, d, s, radius, step):  # type: ignore[no-untyped-def]
    """Units along the ray at distance s that are `step` in the contracted space; and |y|."""
    y0, y1, y2 = (o[0] + s * d[0]) / radius, (o[1] + s * d[1]) / radius, (o[2] + s * d[2]) / radius
    n = max(math.sqrt(y0 * y0 + y1 * y1 + y2 * y2), 1.0)
    cosine = (y0 * d[0] + y1 * d[1] + y2 * d[2]) / n
    across = max(1 - cosine * cosine, 0.0)
    stretch = 2 * n - 1
    return step * radius * n * n / math.sqrt(cosine * cosine + across * stretch * stretch), n


@inlined
def _contracted(o, d, s, radius, voxel):  # type: ignore[no-untyped-def]
    """Voxel coordinates of a point of the ray."""
    y0, y1, y2 = (o[0] + s * d[0]) / radius, (o[1] + s * d[1]) / radius, (o[2] + s * d[2]) / radius
    n = max(math.sqrt(y0 * y0 + y1 * y1 + y2 * y2), 1.0)
    scale = (2 - 1 / n) / n
    return (scale * y0 + 2) / voxel, (scale * y1 + 2) / voxel, (scale * y2 + 2) / voxel


@kernel(parallel=True)
def look(origins, directions, jitter, grid, radius, step, farthest):  # type: ignore[no-untyped-def]
    """(R, 3) rays -> rgb over black (R, 3), transmittance (R,). See `splat` for the arguments."""
    count = origins.shape[0]
    rgb = np.zeros((count, 3), np.float32)
    through = np.ones(count, np.float32)
    voxel = 4.0 / (grid.shape[0] - 1)
    for r in prange(count):
        look_ray(r, origins, directions, jitter, grid, (radius, step, voxel, farthest), rgb, through)
    return rgb, through


@compiled
def look_ray(
    r: Any,
    origins: Any,
    directions: Any,
    jitter: Any,
    grid: Any,
    lengths: Any,
    rgb: Any,
    through: Any,
) -> None:
    """`look` of ray r into rgb and through. lengths: radius, step, side of a voxel, `farthest`."""
    radius, step, voxel, farthest = lengths
    o, d = origins[r], directions[r]
    t, red, green, blue = np.float32(1.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
    s = _start(o, d, radius)
    stride, n = _stride(o, d, s, radius, step)
    while n < farthest and t >= OPAQUE:
        x, y, z = _contracted(o, d, s + jitter[r] * stride, radius, voxel)
        v0, v1, v2, v3 = sample(grid, x, y, z)
        a = np.float32(1 - math.exp(-softplus(v0) * step / voxel))
        red += t * a * v1
        green += t * a * v2
        blue += t * a * v3
        t *= 1 - a
        s += stride
        stride, n = _stride(o, d, s, radius, step)
    rgb[r, 0], rgb[r, 1], rgb[r, 2] = red, green, blue
    through[r] = t


@kernel(parallel=True)
def splat(  # type: ignore[no-untyped-def]
    origins,  # (R, 3) float32
    directions,  # (R, 3) float32, unit
    jitter,  # (R,) float32 in [0, 1): where in its step each sample lies
    grid,  # (M, M, M, 4) float32: raw density, rgb, over [-2, 2]^3 in contracted radii
    radius,  # of the ball, units
    step,  # between samples, contracted radii
    farthest,  # where rays end, radii of the ball
    samples,  # at most so many on a ray
    beyond,  # (R, 3) float32: colours behind the grid
    slope,  # (R, 3) float32: of the loss in the colour of each ray
    gradient,  # (PARTS, M, M, M, 4), added to
    touched,  # (PARTS, M, M) bool, set where the gradient is added to
):
    """Gradient of sum slope . colour. A sample has alpha = 1 - exp(-softplus(raw) step / voxel)."""
    count, parts = origins.shape[0], gradient.shape[0]
    voxel = 4.0 / (grid.shape[0] - 1)
    for part in prange(parts):
        corner = np.empty((samples, 3), np.int32)
        fraction = np.empty((samples, 3), np.float32)
        kept = np.empty((samples, 6), np.float32)
        for r in range(count * part // parts, count * (part + 1) // parts):
            splat_ray(
                r,
                (origins, directions, jitter, beyond, slope),
                grid,
                (radius, step, voxel, farthest),
                gradient[part],
                touched[part],
                (corner, fraction, kept),
            )


@compiled
def splat_ray(r: Any, rays: Any, grid: Any, lengths: Any, gradient: Any, touched: Any, samples: Any) -> None:
    """`splat` of ray r into the gradient (M, M, M, 4) and touched (M, M) of its part. rays are arguments of `splat`,
    lengths as of `look_ray`. Scratch: samples, arrays (S, 3) int32, (S, 3) and (S, 6): colour, alpha, its slope in raw
    density, transmittance before."""
    origins, directions, jitter, beyond, slope = rays
    radius, step, voxel, farthest = lengths
    corner, fraction, kept = samples
    one, density = np.float32(1.0), np.float32(step / voxel)
    o, d = origins[r], directions[r]
    t = one
    m = 0
    s = _start(o, d, radius)
    stride, n = _stride(o, d, s, radius, step)
    while n < farthest and m < corner.shape[0] and t >= OPAQUE:
        x, y, z = _contracted(o, d, s + jitter[r] * stride, radius, voxel)
        s += stride
        stride, n = _stride(o, d, s, radius, step)
        i, j, k, fx, fy, fz = cell(grid, x, y, z)
        w = weights(fx, fy, fz)
        e = math.exp(min(value(grid, i, j, k, w, 0), np.float32(15.0)))
        rest = math.exp(-math.log1p(e) * density)
        a = np.float32(one - rest)
        if a < CLEAR:
            continue
        corner[m, 0], corner[m, 1], corner[m, 2] = i, j, k
        fraction[m, 0], fraction[m, 1], fraction[m, 2] = fx, fy, fz
        kept[m, 0], kept[m, 1] = value(grid, i, j, k, w, 1), value(grid, i, j, k, w, 2)
        kept[m, 2], kept[m, 3] = value(grid, i, j, k, w, 3), a
        kept[m, 4], kept[m, 5] = rest * density * (e / (one + e)), t
        t *= one - a
        m += 1
    b0, b1, b2 = beyond[r, 0], beyond[r, 1], beyond[r, 2]
    d0, d1, d2 = slope[r, 0], slope[r, 1], slope[r, 2]
    for p in range(m - 1, -1, -1):
        a, light = kept[p, 3], kept[p, 5]
        g0, g1, g2 = kept[p, 0] - b0, kept[p, 1] - b1, kept[p, 2] - b2
        pull = d0 * g0 + d1 * g1 + d2 * g2
        b0, b1, b2 = b0 + a * g0, b1 + a * g1, b2 + a * g2
        w = weights(fraction[p, 0], fraction[p, 1], fraction[p, 2])
        wish = (light * pull * kept[p, 4], light * a * d0, light * a * d1, light * a * d2)
        put(gradient, touched, np.uint64(corner[p, 0]), np.uint64(corner[p, 1]), np.uint64(corner[p, 2]), w, wish)
