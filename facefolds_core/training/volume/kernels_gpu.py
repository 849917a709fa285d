"""Entries of the starting volume's kernels on GPUs: the bodies of `kernel`, `look_kernel` and `room_kernel`."""

# numba has no types:
# mypy: disable-error-code="no-untyped-def,attr-defined"

from __future__ import annotations

import numpy as np
from numba import cuda

from facefolds_core.gpu import entry
from facefolds_core.training.volume import kernel, look_kernel, room_kernel

_shade_ray, _adam_voxel = kernel.shade_ray, kernel.adam_voxel
_render_ray, _look_ray, _splat_ray = look_kernel.render_ray, room_kernel.look_ray, room_kernel.splat_ray


@entry
def shade(
    rays,  # origins, directions, jitter, target, background, matte as of `kernel.shade`
    grid,
    occupied,
    lower,
    lengths,  # voxel, step
    gradient,  # (1, X, Y, Z, 4)
    touched,  # (1, X, Y)
    residual,
    transmittance,
    weights,  # of opacity, half opacity, matte
    squares,  # (S,) float64: sums of |C - I|^2 are added to them in turn
    corners,  # (samples, T, 3) int32: scratch of T threads
    values,  # (samples, T, 9) float32
):
    t = cuda.grid(1)
    if t >= corners.shape[1]:
        return
    at = values[:, t]
    kept = (corners[:, t], at[:, 0:3], at[:, 3:6], at[:, 6], at[:, 7], at[:, 8])
    total = 0.0
    for r in range(t, residual.shape[0], corners.shape[1]):
        total += _shade_ray(
            r,
            rays,
            grid,
            occupied,
            lower,
            lengths,
            gradient[0],
            touched[0],
            residual,
            transmittance,
            weights,
            kept,
        )
    cuda.atomic.add(squares, t % squares.shape[0], total)


@entry
def render(origins, directions, grid, lower, voxel, step, rgb, alpha, depth):
    r = cuda.grid(1)
    if r < alpha.shape[0]:
        _render_ray(r, origins, directions, grid, lower, voxel, step, rgb, alpha, depth)


@entry
def copy_density(grid, out):
    v = cuda.grid(1)
    nx, ny, nz = out.shape
    if v < nx * ny * nz:
        i, j, k = v // (ny * nz), v // nz % ny, v % nz
        out[i, j, k] = grid[0, i, j, k, 0]


@entry
def adam_step(grid, gradient, touched, old, share, rates, decay):
    """rates: of density and colour, both corrections, smoothness, as of `kernel.adam_step`; old: of `copy_density`."""
    v = cuda.grid(1)
    nx, ny, nz = old.shape
    if v >= nx * ny * nz:
        return
    i, j, k = v // (ny * nz), v // nz % ny, v % nz
    if not touched[0, i, j]:
        return
    parts = cuda.local.array(1, np.int64)
    total = cuda.local.array(4, np.float32)
    parts[0] = 0
    _adam_voxel(i, j, k, grid, gradient, old, share, rates, decay, parts, total)


@entry
def look(origins, directions, jitter, grid, lengths, rgb, through):
    """lengths: radius, step, side of a voxel, `farthest`, as of `room_kernel.look_ray`."""
    r = cuda.grid(1)
    if r < through.shape[0]:
        _look_ray(r, origins, directions, jitter, grid, lengths, rgb, through)


@entry
def splat(rays, grid, lengths, gradient, touched, corners, values):
    """rays: origins, directions, jitter, beyond, slope as of `room_kernel.splat`; lengths as of `look`; others as of
    `shade`."""
    t = cuda.grid(1)
    if t >= corners.shape[1]:
        return
    at = values[:, t]
    for r in range(t, rays[0].shape[0], corners.shape[1]):
        samples = (corners[:, t], at[:, 0:3], at[:, 3:9])
        _splat_ray(r, rays, grid, lengths, gradient[0], touched[0], samples)
