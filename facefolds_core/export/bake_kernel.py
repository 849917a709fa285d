"""One step of fitting texels to rendered targets, compiled for CPUs. Reference: `bake_reference` (torch)."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from facefolds_core.jit import inlined, kernel

PARTS = 2
"""Rays are worked on in this many parts, side by side, each with sums of its own: the result does not depend on the
number of threads."""

OPAQUE = 1e-3
"""Layers behind less than this transmittance are left out."""

SCALE = 65534.0
"""Texture coordinates in 16 bits: code = 1 + SCALE s, 0 where a ray misses the layer."""


@inlined
def _corner(code, size):  # type: ignore[no-untyped-def]
    """16-bit texture coordinate -> index of the texel before it, and the fraction beyond its centre; clamped."""
    x = min(max((code - 1) * (size / SCALE) - 0.5, 0.0), size - 1.0)
    i = min(int(x), size - 2)
    return i, np.float32(x - i)


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
            j, b = _corner(codes[p, n, 0], width)
            i, a = _corner(codes[p, n, 1], height)
            alpha = _tap(texture, n, i, j, 3, a, b) * scale
            weight = through * alpha * scale
            r0 += weight * _tap(texture, n, i, j, 0, a, b)
            r1 += weight * _tap(texture, n, i, j, 1, a, b)
            r2 += weight * _tap(texture, n, i, j, 2, a, b)
            through *= one - alpha
        out[p, 0], out[p, 1], out[p, 2], out[p, 3] = r0, r1, r2, through


@kernel(parallel=True)
def accumulate(  # type: ignore[no-untyped-def]
    codes,  # (P, N, 2) uint16
    target,  # (P, 4) float32: rgb over black and transmittance
    texture,  # (N, H, W, 4) float32 in [0, 1]
    sums,  # (PARTS, N, H, W, 6), added to
):
    """Adds, for each texel: sum J r of its rgb and alpha, and sum |J| (row sum of |J|) of colour and of alpha.

    r = (C - C*, T - T*) of a ray, J its derivative by the texel's values. Returns the sum of |r|^2.
    """
    height, width, layers = texture.shape[1], texture.shape[2], texture.shape[0]
    count = codes.shape[0]
    totals = np.zeros(PARTS)
    one = np.float32(1.0)
    for part in prange(PARTS):
        own = sums[part]
        layer = np.empty(layers, np.int64)
        row = np.empty(layers, np.int64)
        column = np.empty(layers, np.int64)
        a = np.empty(layers, np.float32)
        b = np.empty(layers, np.float32)
        c = np.empty((layers, 4), np.float32)
        before = np.empty(layers, np.float32)
        slope = np.empty(layers, np.float32)
        size = np.empty(layers, np.float32)
        total = 0.0
        for p in range(count * part // PARTS, count * (part + 1) // PARTS):
            through = one
            r0, r1, r2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            m = 0
            for n in range(layers):
                if codes[p, n, 0] == 0:
                    continue
                j, fb = _corner(codes[p, n, 0], width)
                i, fa = _corner(codes[p, n, 1], height)
                alpha = _tap(texture, n, i, j, 3, fa, fb)
                if alpha <= np.float32(0.0):
                    continue
                layer[m], row[m], column[m], a[m], b[m] = n, i, j, fa, fb
                for q in range(3):
                    c[m, q] = _tap(texture, n, i, j, q, fa, fb)
                c[m, 3] = alpha
                before[m] = through
                weight = through * alpha
                r0 += weight * c[m, 0]
                r1 += weight * c[m, 1]
                r2 += weight * c[m, 2]
                through *= one - alpha
                m += 1
                if through < OPAQUE:
                    break
            d0, d1, d2 = r0 - target[p, 0], r1 - target[p, 1], r2 - target[p, 2]
            d3 = through - target[p, 3]
            total += d0 * d0 + d1 * d1 + d2 * d2 + d3 * d3
            # From the back: s is the colour, rest the transmittance of what lies behind a layer.
            s0, s1, s2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
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
                weight = before[q] * c[q, 3]
                e0, e1, e2, e3 = weight * d0, weight * d1, weight * d2, slope[q]
                e4, e5 = weight * norm, size[q] * norm
                for tap in range(4):
                    di, dj = tap >> 1, tap & 1
                    w = (a[q] if di else one - a[q]) * (b[q] if dj else one - b[q])
                    texel = own[layer[q], row[q] + di, column[q] + dj]
                    texel[0] += w * e0
                    texel[1] += w * e1
                    texel[2] += w * e2
                    texel[3] += w * e3
                    texel[4] += w * e4
                    texel[5] += w * e5
        totals[part] = total
    return totals.sum()


@kernel(parallel=True)
def update(values, sums, damping, shown):  # type: ignore[no-untyped-def]
    """values (M, 4) -= sum J r / (damping + sum |J| row), in [0, 1]; sums (PARTS, M, 6) are zeroed.

    shown (M, 4) becomes what 8 bits hold of values. Texels without rays stay as they are.
    """
    for k in prange(values.shape[0]):
        colour, opacity = np.float32(0.0), np.float32(0.0)
        for part in range(sums.shape[0]):
            colour += sums[part, k, 4]
            opacity += sums[part, k, 5]
        if opacity > 0:
            for q in range(4):
                g = np.float32(0.0)
                for part in range(sums.shape[0]):
                    g += sums[part, k, q]
                value = values[k, q] - g / ((colour if q < 3 else opacity) + np.float32(damping))
                values[k, q] = min(max(value, np.float32(0.0)), np.float32(1.0))
                shown[k, q] = np.rint(values[k, q] * np.float32(255.0)) * np.float32(1 / 255.0)
            for part in range(sums.shape[0]):
                for q in range(6):
                    sums[part, k, q] = 0


@kernel
def true_positions(vertices, faces, st, window, out):  # type: ignore[no-untyped-def]
    """Where each texel of a mesh's texture lies in the layer: out (H, W, 2) float32 columns and rows, in texels.

    A texel (row, column) sits in a triangle in the plane of (s, t), and so at a point of the mesh; the direction of
    that point from c, in texture coordinates, is what belongs there. Texels outside all triangles stay as they are in
    out.

    vertices (V, 3) relative to c, faces (F, 3), st (V, 2), window (u0, u1, v0, v1).
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
                u = 2.0 / math.pi * math.asin(min(max(z / math.sqrt(x * x + y * y + z * z), -1.0), 1.0))
                v = 2.0 / math.pi * math.atan2(y, x)
                out[row, column, 0] = (v - window[2]) / (window[3] - window[2]) * width - 0.5
                out[row, column, 1] = (window[1] - u) / (window[1] - window[0]) * height - 0.5
