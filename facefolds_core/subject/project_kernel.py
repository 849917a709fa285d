"""Gaussians onto a picture, and gradients back: the local affine approximation of Zwicker et al. 2001, compiled.

Reference: `tests/subject/reference.py`."""

# numba has no types:
# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from facefolds_core.kernels.jit import compiled, kernel

PLANE = 13
"""Columns of what a picture sees of a Gaussian: mean x, y in pixels; p = A dx^2 + B dx dy + C dy^2 as A, B, C, its
opacity being o exp(-p); o; RGB; depth along the optical axis, units; the p at which it is `FAINT`; how far up and down
it reaches, pixels; -B / 2A, the dx of a row's least p in shares of dy."""
FLAT = 10
"""Columns of a gradient in the picture: sums over pixels of v, v dx, v dy, v dx^2, v dx dy, v dy^2, where v is opacity
times the loss's derivative by it; of the derivative by RGB; and the length of the derivative by the mean."""

BLUR = 0.3
"""Added to the variance of a Gaussian in the picture, pixels^2: none falls between the pixels."""
FAINT = 1 / 255
"""Less opacity is nothing."""
NEAR = 0.05
"""Nothing is drawn nearer to the camera, units."""
WIDE = 1.3
"""The affine approximation is taken at most at so many half pictures from the axis."""


@compiled
def turned(q: Any, r: Any) -> Any:
    """Rotation matrix, into r (3, 3), of a quaternion (4,) of any length, which is returned."""
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, x, y, z = q[0] / length, q[1] / length, q[2] / length, q[3] / length
    r[0, 0], r[0, 1], r[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    r[1, 0], r[1, 1], r[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    r[2, 0], r[2, 1], r[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return length


@compiled
def spread_of(row: Any, view: Any, size: Any, r: Any, m: Any, t: Any, u: Any) -> Any:
    """What both directions need: r (3, 3) axes, m (3, 3) axes times standard deviations, t (2, 3) the derivative of
    pixels by the world's positions, u = t m; returns the position in the camera, with its x and y as t takes them.

    Args:
        view: (5, 3): the rows of R and the translation of the camera; fx, fy, skew.
        size: (width, height) of the picture, pixels.
    """
    turned(row[6:10], r)
    for k in range(3):
        s = math.exp(row[3 + k])
        for i in range(3):
            m[i, k] = r[i, k] * s
    x, y, z = view[3, 0], view[3, 1], view[3, 2]
    for k in range(3):
        x += view[0, k] * row[k]
        y += view[1, k] * row[k]
        z += view[2, k] * row[k]
    fx, fy, skew = view[4, 0], view[4, 1], view[4, 2]
    far_x, far_y = WIDE * 0.5 * size[0] / fx * z, WIDE * 0.5 * size[1] / fy * z
    cx, cy = min(max(x, -far_x), far_x), min(max(y, -far_y), far_y)
    if z > NEAR:
        for k in range(3):
            t[0, k] = (fx * view[0, k] + skew * view[1, k] - (fx * cx + skew * cy) / z * view[2, k]) / z
            t[1, k] = (fy * view[1, k] - fy * cy / z * view[2, k]) / z
        for i in range(2):
            for k in range(3):
                u[i, k] = t[i, 0] * m[0, k] + t[i, 1] * m[1, k] + t[i, 2] * m[2, k]
    return x, y, z, cx, cy


@kernel(parallel=True)
def project(values, view, centre, size, tile, plane, tiles):
    """What a camera sees of each Gaussian.

    Args:
        values: (N, COLUMNS).
        view: (6, 3) float64: rows of R, translation, (fx, fy, skew), (cx, cy, 0).
        centre: (3,) of the camera, units.
        size: (width, height) of the picture.
        tile: (width, height) of a tile, pixels.
        plane: (N, PLANE) float32 out.
        tiles: (N, 4) int32 out: first and last + 1 column of tiles, the same of rows; nothing where it is not seen.
    """
    across, down = -(-size[0] // tile[0]), -(-size[1] // tile[1])
    for n in prange(values.shape[0]):
        tiles[n, :] = 0
        row = values[n]
        o = 1 / (1 + math.exp(-row[10]))
        if o <= FAINT:
            continue
        z = view[2, 0] * row[0] + view[2, 1] * row[1] + view[2, 2] * row[2] + view[3, 2]
        if z <= NEAR:
            continue
        r, m, t, u = np.empty((3, 3)), np.empty((3, 3)), np.empty((2, 3)), np.empty((2, 3))
        x, y, z, _, _ = spread_of(row, view, size, r, m, t, u)
        px = (view[4, 0] * x + view[4, 2] * y) / z + view[5, 0]
        py = view[4, 1] * y / z + view[5, 1]
        xx = u[0, 0] * u[0, 0] + u[0, 1] * u[0, 1] + u[0, 2] * u[0, 2] + BLUR
        xy = u[0, 0] * u[1, 0] + u[0, 1] * u[1, 1] + u[0, 2] * u[1, 2]
        yy = u[1, 0] * u[1, 0] + u[1, 1] * u[1, 1] + u[1, 2] * u[1, 2] + BLUR
        reach = 2 * math.log(o / FAINT)
        wide, high = math.sqrt(reach * xx), math.sqrt(reach * yy)
        # A pixel is met where its centre is.
        x0, x1 = math.ceil(px - wide - 0.5), math.floor(px + wide - 0.5) + 1
        y0, y1 = math.ceil(py - high - 0.5), math.floor(py + high - 0.5) + 1
        if x1 <= max(x0, 0) or y1 <= max(y0, 0) or x0 >= size[0] or y0 >= size[1]:
            continue
        tiles[n, 0], tiles[n, 1] = max(x0, 0) // tile[0], min(-(-x1 // tile[0]), across)
        tiles[n, 2], tiles[n, 3] = max(y0, 0) // tile[1], min(-(-y1 // tile[1]), down)
        det = xx * yy - xy * xy
        plane[n, 0], plane[n, 1] = px, py
        plane[n, 2], plane[n, 3], plane[n, 4] = 0.5 * yy / det, -xy / det, 0.5 * xx / det
        plane[n, 5], plane[n, 9] = o, z
        plane[n, 10], plane[n, 11], plane[n, 12] = 0.5 * reach, high, xy / yy
        dx, dy, dz = row[0] - centre[0], row[1] - centre[1], row[2] - centre[2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        for q in range(3):
            plane[n, 6 + q] = row[11 + q] + (dx * row[14 + q] + dy * row[17 + q] + dz * row[20 + q]) / length


@kernel(parallel=True)
def unproject(values, view, centre, size, plane, first, flat, gradient, moved):
    """The loss's derivatives by the Gaussians from those in the picture.

    Args:
        values, view, centre, size, plane: of `project`.
        first: (N + 1,) int64: rows first[n] to first[n + 1] of `flat` belong to Gaussian n.
        flat: (E, FLAT) float32.
        gradient: (N, COLUMNS) float32 out; all 0 where nothing is seen.
        moved: (N,) float32 out: length of the derivative by the mean in the picture, in halves of the picture, summed
            over tiles.
    """
    for n in prange(values.shape[0]):
        gradient[n, :] = 0
        moved[n] = 0
        if first[n + 1] == first[n]:
            continue
        g = np.zeros(FLAT)
        for e in range(first[n], first[n + 1]):
            for q in range(FLAT):
                g[q] += flat[e, q]
        row, seen = values[n], plane[n]
        moved[n] = g[9]
        a, b, c, o = seen[2], seen[3], seen[4], seen[5]
        r, m, t, u = np.empty((3, 3)), np.empty((3, 3)), np.empty((2, 3)), np.empty((2, 3))
        x, y, z, cx, cy = spread_of(row, view, size, r, m, t, u)
        fx, fy, skew = view[4, 0], view[4, 1], view[4, 2]
        # By the mean in the picture, then by the covariance in it: -L G L, with L its inverse [2a b; b 2c].
        gx, gy = 2 * a * g[1] + b * g[2], b * g[1] + 2 * c * g[2]
        h00, h01, h11 = -0.5 * g[3], -0.5 * g[4], -0.5 * g[5]
        k00, k01 = 2 * a * h00 + b * h01, 2 * a * h01 + b * h11
        k10, k11 = b * h00 + 2 * c * h01, b * h01 + 2 * c * h11
        gxx, gyy = -(k00 * 2 * a + k01 * b), -(k10 * b + k11 * 2 * c)
        gxy = -2 * (k00 * b + k01 * 2 * c)
        du, dt, dm = np.empty((2, 3)), np.empty((2, 3)), np.empty((3, 3))
        for k in range(3):
            du[0, k] = 2 * gxx * u[0, k] + gxy * u[1, k]
            du[1, k] = 2 * gyy * u[1, k] + gxy * u[0, k]
        for k in range(3):
            for i in range(2):
                dt[i, k] = du[i, 0] * m[k, 0] + du[i, 1] * m[k, 1] + du[i, 2] * m[k, 2]
            for i in range(3):
                dm[i, k] = t[0, i] * du[0, k] + t[1, i] * du[1, k]
        # t by the position in the camera; where x or y was held back, they have no part in it.
        j = np.zeros((2, 3))
        for i in range(2):
            for k in range(3):
                j[i, k] = dt[i, 0] * view[k, 0] + dt[i, 1] * view[k, 1] + dt[i, 2] * view[k, 2]
        zz = z * z
        dx = (gx * fx) / z
        dy = (gx * skew + gy * fy) / z
        dz = -(gx * (fx * x + skew * y) + gy * fy * y) / zz
        ex, ey = -j[0, 2] * fx / zz, -(j[0, 2] * skew + j[1, 2] * fy) / zz
        dz -= (j[0, 0] * fx + j[0, 1] * skew + j[1, 1] * fy) / zz
        dz += 2 * (j[0, 2] * (fx * cx + skew * cy) + j[1, 2] * fy * cy) / (zz * z)
        if cx == x:
            dx += ex
        else:
            dz += ex * cx / z
        if cy == y:
            dy += ey
        else:
            dz += ey * cy / z
        for k in range(3):
            gradient[n, k] = dx * view[0, k] + dy * view[1, k] + dz * view[2, k]
            gradient[n, 3 + k] = dm[0, k] * m[0, k] + dm[1, k] * m[1, k] + dm[2, k] * m[2, k]
            s = math.exp(row[3 + k])
            for i in range(3):
                dm[i, k] *= s
        unturn(row[6:10], dm, gradient[n, 6:10])
        gradient[n, 10] = g[0] * (1 - o)
        dx, dy, dz = row[0] - centre[0], row[1] - centre[1], row[2] - centre[2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        for q in range(3):
            gradient[n, 11 + q] = g[6 + q]
            gradient[n, 14 + q] = g[6 + q] * dx / length
            gradient[n, 17 + q] = g[6 + q] * dy / length
            gradient[n, 20 + q] = g[6 + q] * dz / length


@compiled
def unturn(q: Any, d: Any, out: Any) -> None:
    """Derivative by a quaternion (4,) of any length, from that by its matrix (3, 3)."""
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, x, y, z = q[0] / length, q[1] / length, q[2] / length, q[3] / length
    dw = 2 * (x * (d[2, 1] - d[1, 2]) + y * (d[0, 2] - d[2, 0]) + z * (d[1, 0] - d[0, 1]))
    dx = 2 * (y * (d[0, 1] + d[1, 0]) + z * (d[0, 2] + d[2, 0]) + w * (d[2, 1] - d[1, 2]) - 2 * x * (d[1, 1] + d[2, 2]))
    dy = 2 * (x * (d[0, 1] + d[1, 0]) + z * (d[1, 2] + d[2, 1]) + w * (d[0, 2] - d[2, 0]) - 2 * y * (d[0, 0] + d[2, 2]))
    dz = 2 * (x * (d[0, 2] + d[2, 0]) + y * (d[1, 2] + d[2, 1]) + w * (d[1, 0] - d[0, 1]) - 2 * z * (d[0, 0] + d[1, 1]))
    along = w * dw + x * dx + y * dy + z * dz
    out[0], out[1] = (dw - w * along) / length, (dx - x * along) / length
    out[2], out[3] = (dy - y * along) / length, (dz - z * along) / length
