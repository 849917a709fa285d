"""One step of fitting texels to rendered targets, compiled for CPUs. Tests hold it against plain torch."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from facefolds_core.geometry.chart_kernel import chart_position
from facefolds_core.kernels.hit_codes import corner
from facefolds_core.kernels.jit import compiled, inlined, kernel
from facefolds_core.kernels.scatter import BLOCK, CHUNK, scatter_of, spread

_scatter = scatter_of(6)


@inlined
def _tap(texture, n, i, j, q, a, b):  # type: ignore[no-untyped-def]
    one = np.float32(1.0)
    top = texture[n, i, j, q] * (one - b) + texture[n, i, j + 1, q] * b
    bottom = texture[n, i + 1, j, q] * (one - b) + texture[n, i + 1, j + 1, q] * b
    return top * (one - a) + bottom * a


@kernel(parallel=True)
def render(codes, texture, out):  # type: ignore[no-untyped-def]
    """codes (P, N, 2) uint16, texture (N, H, W, 4) in [0, 255] -> out (P, 4) float32: rgb over black, transmittance."""
    height, width = texture.shape[1], texture.shape[2]
    scale = np.float32(1 / 255.0)
    one = np.float32(1.0)
    for p in prange(codes.shape[0]):
        through = one
        r0, r1, r2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for n in range(codes.shape[1]):
            if codes[p, n, 0] == 0:
                continue
            j, b = corner(codes[p, n, 0], width)
            i, a = corner(codes[p, n, 1], height)
            alpha = _tap(texture, n, i, j, 3, a, b) * scale
            weight = through * alpha * scale
            r0 += weight * _tap(texture, n, i, j, 0, a, b)
            r1 += weight * _tap(texture, n, i, j, 1, a, b)
            r2 += weight * _tap(texture, n, i, j, 2, a, b)
            through *= one - alpha
        out[p, 0], out[p, 1], out[p, 2], out[p, 3] = r0, r1, r2, through


@kernel(parallel=True)
def accumulate(codes, target, texture, sums, min_light):  # type: ignore[no-untyped-def]
    """Adds, for each texel: sum J r of its rgb and alpha, and sum |J| (row sum of |J|) of colour and of alpha.

    r = (C - C*, T - T*) of a ray, J its derivative by the texel's values. Returns the sum of |r|^2.

    codes (P, N, 2) uint16, target (P, 4) float32: rgb over black and transmittance; texture (N, H, W, 4) float32 in
    [0, 1]; sums (N, H, W, 6) are added to, each in the order of the rays: the result does not depend on the threads.
    Layers behind less transmittance than `min_light` are left out.
    """
    layers, count = texture.shape[0], codes.shape[0]
    squares = np.zeros((count + BLOCK - 1) // BLOCK)
    index = np.empty((layers, CHUNK), np.int32)
    wish = np.empty((layers, CHUNK, 8), np.float32)
    for start in range(0, count, CHUNK):
        own = min(CHUNK, count - start)
        for block in prange((own + BLOCK - 1) // BLOCK):
            first, last = block * BLOCK, min((block + 1) * BLOCK, own)
            squares[start // BLOCK + block] = _residuals(
                codes[start + first : start + last],
                target[start + first : start + last],
                texture,
                min_light,
                index[:, first:last],
                wish[:, first:last],
            )
        for task in prange(layers):
            n = spread(task, layers)
            _scatter(index[n, :own], wish[n, :own], sums[n])
    total = 0.0  # not squares.sum(), which numba shares out among the threads
    for block in range(squares.shape[0]):
        total += squares[block]
    return total


@compiled
def _residuals(codes: Any, target: Any, texture: Any, min_light: Any, index: Any, wish: Any) -> Any:
    """A block of R rays: texels before their hits (N, R), -1 where there is none, and what is to be added there
    (N, R, 8): fractions of row and column, and the six sums. Returns the sum of |r|^2."""
    height, width, layers = texture.shape[1], texture.shape[2], texture.shape[0]
    one, zero = np.float32(1.0), np.float32(0.0)
    layer = np.empty(layers, np.int64)
    c = np.empty((layers, 4), np.float32)
    before, slope, size = np.empty(layers, np.float32), np.empty(layers, np.float32), np.empty(layers, np.float32)
    total = 0.0
    for p in range(codes.shape[0]):
        through, r0, r1, r2 = one, zero, zero, zero
        m = 0
        for n in range(layers):
            index[n, p] = -1
        for n in range(layers):
            if codes[p, n, 0] == 0:
                continue
            j, b = corner(codes[p, n, 0], width)
            i, a = corner(codes[p, n, 1], height)
            alpha = _tap(texture, n, i, j, 3, a, b)
            if alpha <= zero:
                continue
            index[n, p] = i * width + j
            wish[n, p, 0], wish[n, p, 1] = a, b
            for q in range(3):
                c[m, q] = _tap(texture, n, i, j, q, a, b)
            c[m, 3] = alpha
            layer[m], before[m] = n, through
            weight = through * alpha
            r0 += weight * c[m, 0]
            r1 += weight * c[m, 1]
            r2 += weight * c[m, 2]
            through *= one - alpha
            m += 1
            if through < min_light:
                break
        d0, d1, d2 = r0 - target[p, 0], r1 - target[p, 1], r2 - target[p, 2]
        d3 = through - target[p, 3]
        total += d0 * d0 + d1 * d1 + d2 * d2 + d3 * d3
        # From the back: s is the colour, rest the transmittance of what lies behind a layer.
        s0, s1, s2 = zero, zero, zero
        rest = one
        norm = one - through
        for q in range(m - 1, -1, -1):
            alpha = c[q, 3]
            g0, g1, g2 = c[q, 0] - s0, c[q, 1] - s1, c[q, 2] - s2
            slope[q] = before[q] * (d0 * g0 + d1 * g1 + d2 * g2 - d3 * rest)
            size[q] = before[q] * max(max(abs(g0), abs(g1)), max(abs(g2), rest))
            norm += size[q]
            rest *= one - alpha
            s0, s1, s2 = s0 + alpha * g0, s1 + alpha * g1, s2 + alpha * g2
        for q in range(m):
            n, weight = layer[q], before[q] * c[q, 3]
            wish[n, p, 2], wish[n, p, 3], wish[n, p, 4] = weight * d0, weight * d1, weight * d2
            wish[n, p, 5], wish[n, p, 6], wish[n, p, 7] = slope[q], weight * norm, size[q] * norm
    return total


@kernel(parallel=True)
def update(values, sums, damping, shown):  # type: ignore[no-untyped-def]
    """values (M, 4) -= sum J r / (damping + sum |J| row), in [0, 1]; sums (M, 6) are zeroed.

    shown (M, 4) becomes what 8 bits hold of values. Texels without rays stay as they are.
    """
    for k in prange(values.shape[0]):
        if sums[k, 5] > 0:
            for q in range(4):
                value = values[k, q] - sums[k, q] / (sums[k, 4 if q < 3 else 5] + np.float32(damping))
                values[k, q] = min(max(value, np.float32(0.0)), np.float32(1.0))
                shown[k, q] = np.rint(values[k, q] * np.float32(255.0)) * np.float32(1 / 255.0)
            for q in range(6):
                sums[k, q] = 0


@kernel
def true_positions(vertices, faces, st, window, belt, out):  # type: ignore[no-untyped-def]
    """Where each texel of a mesh's texture lies in the layer: out (H, W, 2) float32 columns and rows, in texels.

    A texel (row, column) sits in a triangle in the plane of (s, t), and so at a point of the mesh; (u, v) of that
    point, in texture coordinates, is what belongs there. Texels outside all triangles stay as they are in out.

    vertices (V, 3) relative to c, faces (F, 3), st (V, 2), window (u0, u1, v0, v1), belt (4,) of
    `Chart.numbers`.
    """
    height, width = out.shape[0], out.shape[1]
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x0, y0 = st[i, 0] * width - 0.5, st[i, 1] * height - 0.5
        x1, y1 = st[j, 0] * width - 0.5 - x0, st[j, 1] * height - 0.5 - y0
        x2, y2 = st[k, 0] * width - 0.5 - x0, st[k, 1] * height - 0.5 - y0
        det = x1 * y2 - x2 * y1
        if det == 0.0:
            continue
        top, bottom = math.ceil(y0 + min(0.0, y1, y2) - 1e-6), math.floor(y0 + max(0.0, y1, y2) + 1e-6)
        left, right = math.ceil(x0 + min(0.0, x1, x2) - 1e-6), math.floor(x0 + max(0.0, x1, x2) + 1e-6)
        for row in range(max(top, 0), min(bottom, height - 1) + 1):
            for column in range(max(left, 0), min(right, width - 1) + 1):
                b = ((column - x0) * y2 - x2 * (row - y0)) / det
                c = (x1 * (row - y0) - (column - x0) * y1) / det
                a = 1.0 - b - c
                if a < -1e-6 or b < -1e-6 or c < -1e-6:
                    continue
                x = a * vertices[i, 0] + b * vertices[j, 0] + c * vertices[k, 0]
                y = a * vertices[i, 1] + b * vertices[j, 1] + c * vertices[k, 1]
                z = a * vertices[i, 2] + b * vertices[j, 2] + c * vertices[k, 2]
                u, v, _ = chart_position(x, y, z, belt)
                out[row, column, 0] = (v - window[2]) / (window[3] - window[2]) * width - 0.5
                out[row, column, 1] = (window[1] - u) / (window[1] - window[0]) * height - 0.5
