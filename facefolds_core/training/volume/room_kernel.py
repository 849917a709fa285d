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
from facefolds_core.training.volume.kernel import put
from facefolds_core.training.volume.look_kernel import CLEAR, OPAQUE, sample, softplus


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
def _contracted(o, d, s, radius, voxel, out):  # type: ignore[no-untyped-def]
    """Voxel coordinates of a point of the ray into out[0:3]."""
    y0, y1, y2 = (o[0] + s * d[0]) / radius, (o[1] + s * d[1]) / radius, (o[2] + s * d[2]) / radius
    n = max(math.sqrt(y0 * y0 + y1 * y1 + y2 * y2), 1.0)
    scale = (2 - 1 / n) / n
    out[0], out[1], out[2] = (scale * y0 + 2) / voxel, (scale * y1 + 2) / voxel, (scale * y2 + 2) / voxel


@kernel(parallel=True)
def look(origins, directions, jitter, grid, radius, step, farthest):  # type: ignore[no-untyped-def]
    """(R, 3) rays -> rgb over black (R, 3), transmittance (R,). See `splat` for the arguments."""
    count = origins.shape[0]
    rgb = np.zeros((count, 3), np.float32)
    through = np.ones(count, np.float32)
    voxel = 4.0 / (grid.shape[0] - 1)
    for r in prange(count):
        value, at = np.empty(4, np.float32), np.empty(3)
        look_ray(r, origins, directions, jitter, grid, (radius, step, voxel, farthest), rgb, through, value, at)
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
    value: Any,
    at: Any,
) -> None:
    """`look` of ray r into rgb, which is 0, and through. lengths: radius, step, side of a voxel, `farthest`. Scratch:
    value (4,), at (3,) float64."""
    radius, step, voxel, farthest = lengths
    o, d = origins[r], directions[r]
    t = np.float32(1.0)
    s = _start(o, d, radius)
    stride, n = _stride(o, d, s, radius, step)
    while n < farthest and t >= OPAQUE:
        _contracted(o, d, s + jitter[r] * stride, radius, voxel, at)
        sample(grid, at[0], at[1], at[2], value)
        a = np.float32(1 - math.exp(-softplus(value[0]) * step / voxel))
        for q in range(3):
            rgb[r, q] += t * a * value[q + 1]
        t *= 1 - a
        s += stride
        stride, n = _stride(o, d, s, radius, step)
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
        value, behind, at = np.empty(4, np.float32), np.empty(3, np.float32), np.empty(3)
        for r in range(count * part // parts, count * (part + 1) // parts):
            splat_ray(
                r,
                (origins, directions, jitter, beyond, slope),
                grid,
                (radius, step, voxel, farthest),
                gradient[part],
                touched[part],
                (corner, fraction, kept),
                (value, behind, at),
            )


@compiled
def splat_ray(r: Any, rays: Any, grid: Any, lengths: Any, gradient: Any, touched: Any, samples: Any, own: Any) -> None:
    """`splat` of ray r into the gradient (M, M, M, 4) and touched (M, M) of its part. rays are arguments of `splat`,
    lengths as of `look_ray`. Scratch: samples, arrays (S, 3) int32, (S, 3) and (S, 6): colour, alpha, its slope in raw
    density, transmittance before; own, arrays (4,), (3,), and (3,) float64."""
    origins, directions, jitter, beyond, slope = rays
    radius, step, voxel, farthest = lengths
    (corner, fraction, kept), (value, behind, at) = samples, own
    density = step / voxel
    o, d = origins[r], directions[r]
    t = np.float32(1.0)
    m = 0
    s = _start(o, d, radius)
    stride, n = _stride(o, d, s, radius, step)
    while n < farthest and m < corner.shape[0] and t >= OPAQUE:
        _contracted(o, d, s + jitter[r] * stride, radius, voxel, at)
        s += stride
        stride, n = _stride(o, d, s, radius, step)
        i, j, k, fx, fy, fz = sample(grid, at[0], at[1], at[2], value)
        rest = math.exp(-softplus(value[0]) * density)
        a = np.float32(1 - rest)
        if a < CLEAR:
            continue
        corner[m, 0], corner[m, 1], corner[m, 2] = i, j, k
        fraction[m, 0], fraction[m, 1], fraction[m, 2] = fx, fy, fz
        kept[m, 0], kept[m, 1], kept[m, 2] = value[1], value[2], value[3]
        kept[m, 3], kept[m, 4], kept[m, 5] = a, rest * density / (1 + math.exp(-value[0])), t
        t *= 1 - a
        m += 1
    for q in range(3):
        behind[q] = beyond[r, q]
    for p in range(m - 1, -1, -1):
        a, light = kept[p, 3], kept[p, 5]
        pull = np.float32(0.0)
        for q in range(3):
            pull += slope[r, q] * (kept[p, q] - behind[q])
            behind[q] = a * kept[p, q] + (1 - a) * behind[q]
        place = (corner[p, 0], corner[p, 1], corner[p, 2], fraction[p, 0], fraction[p, 1], fraction[p, 2])
        put(place, light * pull * kept[p, 4], light, a, slope[r], gradient, touched)
