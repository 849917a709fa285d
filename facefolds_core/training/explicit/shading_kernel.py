"""Shading of stored crossings, forwards and backwards in one pass, compiled for CPUs. Reference: `reference.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.jit import inlined, kernel

Array = NDArray[Any]

PARTS = 2
"""Rays are shaded in this many parts, side by side, each with a gradient of its own: the result does not depend on the
number of threads."""

OPAQUE = 0.002
"""Layers behind less than this transmittance are left out."""


@inlined
def _corner(code, size):  # type: ignore[no-untyped-def]
    """16-bit position over the window -> index of the texel before it, and the fraction beyond its centre."""
    x = min(max((code - 1) * (size / 65534.0) - 0.5, 0.0), size - 1.0)
    i = min(int(x), size - 2)
    return i, np.float32(x - i)


@inlined
def _tap(texture, i, j, n, q, a, b):  # type: ignore[no-untyped-def]
    one = np.float32(1.0)
    top = texture[i, j, n, q] * (one - b) + texture[i, j + 1, n, q] * b
    bottom = texture[i + 1, j, n, q] * (one - b) + texture[i + 1, j + 1, n, q] * b
    return top * (one - a) + bottom * a


@kernel(parallel=True)
def shade(  # type: ignore[no-untyped-def]
    codes,  # (P, N, 2) uint16: 1 + 65534 s, 1 + 65534 t of the crossing with each layer; 0 where missed
    camera,  # (P,) int32
    pixel,  # (P,) int32
    rays,  # (R,) int64, which of the P to shade, none twice
    images,  # (C, H W, 3) uint8
    background,  # (C, H W, 3) float32, updated in place
    texture,  # (H, W, N, 4) rgb and alpha in [0, 1]
    gradient,  # (PARTS, H, W, N, 4), added to
    veil,  # weight of opacity
    solid,  # weight of rays that are nearly, but not quite, opaque
    rate,  # of the background
    faint,  # layers with less alpha are left out
):
    """Differentiates the sum over rays of 0.5 |C - I|^2 + veil (1 - T) + solid t (1 - t), t = min(T, 1/2).

    Adds the gradient to `gradient`; returns the sum of |C - I|^2.
    C = sum_i w_i c_i + T B. Each pixel's background moves by -rate T^3 (C - I): in proportion to the cube of the
    transmittance, so that it cannot explain what the layers have begun to explain.
    """
    height, width, layers = texture.shape[0], texture.shape[1], texture.shape[2]
    count = rays.shape[0]
    parts = gradient.shape[0]
    sums = np.zeros(parts)
    one = np.float32(1.0)
    for part in prange(parts):
        own = gradient[part]
        layer = np.empty(layers, np.int64)
        row = np.empty(layers, np.int64)
        column = np.empty(layers, np.int64)
        a = np.empty(layers, np.float32)
        b = np.empty(layers, np.float32)
        c = np.empty((layers, 4), np.float32)
        before = np.empty(layers, np.float32)
        total = 0.0
        for k in range(count * part // parts, count * (part + 1) // parts):
            p = rays[k]
            through = one
            r0 = np.float32(0.0)
            r1 = np.float32(0.0)
            r2 = np.float32(0.0)
            m = 0
            for n in range(layers):
                if codes[p, n, 0] == 0:
                    continue
                j, fb = _corner(codes[p, n, 0], width)
                i, fa = _corner(codes[p, n, 1], height)
                alpha = _tap(texture, i, j, n, 3, fa, fb)
                if alpha < faint:
                    continue
                layer[m], row[m], column[m], a[m], b[m] = n, i, j, fa, fb
                for q in range(3):
                    c[m, q] = _tap(texture, i, j, n, q, fa, fb)
                c[m, 3] = alpha
                before[m] = through
                r0 += through * alpha * c[m, 0]
                r1 += through * alpha * c[m, 1]
                r2 += through * alpha * c[m, 2]
                through *= one - alpha
                m += 1
                if through < OPAQUE:
                    break
            cam, pix = camera[p], pixel[p]
            inverse = np.float32(1 / 255.0)
            s0, s1, s2 = background[cam, pix, 0], background[cam, pix, 1], background[cam, pix, 2]
            d0 = r0 + through * s0 - images[cam, pix, 0] * inverse
            d1 = r1 + through * s1 - images[cam, pix, 1] * inverse
            d2 = r2 + through * s2 - images[cam, pix, 2] * inverse
            total += d0 * d0 + d1 * d1 + d2 * d2
            step = np.float32(rate) * through * through * through
            background[cam, pix, 0] = min(max(s0 - step * d0, np.float32(0.0)), one)
            background[cam, pix, 1] = min(max(s1 - step * d1, np.float32(0.0)), one)
            background[cam, pix, 2] = min(max(s2 - step * d2, np.float32(0.0)), one)
            # From the back: s is the colour, rest the transmittance of all that lies behind layer q.
            push = np.float32(veil - solid * max(1 - 2 * through, np.float32(0.0)))
            rest = one
            for q in range(m - 1, -1, -1):
                alpha = c[q, 3]
                light = before[q]
                slope = d0 * (c[q, 0] - s0) + d1 * (c[q, 1] - s1) + d2 * (c[q, 2] - s2) + push * rest
                rest *= one - alpha
                s0 = alpha * c[q, 0] + (one - alpha) * s0
                s1 = alpha * c[q, 1] + (one - alpha) * s1
                s2 = alpha * c[q, 2] + (one - alpha) * s2
                e0, e1, e2, e3 = light * alpha * d0, light * alpha * d1, light * alpha * d2, light * slope
                for tap in range(4):
                    di, dj = tap >> 1, tap & 1
                    w = (a[q] if di else one - a[q]) * (b[q] if dj else one - b[q])
                    i, j, n = row[q] + di, column[q] + dj, layer[q]
                    own[i, j, n, 0] += w * e0
                    own[i, j, n, 1] += w * e1
                    own[i, j, n, 2] += w * e2
                    own[i, j, n, 3] += w * e3
        sums[part] = total
    return sums.sum()


@kernel(parallel=True)
def contributions(  # type: ignore[no-untyped-def]
    codes,  # (P, N, 2) uint16, as above
    rays,  # (R,) int64, which of the P to look at
    texture,  # (H, W, N, 4)
    peak,  # (PARTS, H, W, N) float32, raised to what is found
):
    """What each texel adds to a ray's opacity at most: T w alpha; w bilinear weight, T transmittance before it."""
    height, width, layers = texture.shape[0], texture.shape[1], texture.shape[2]
    count = rays.shape[0]
    parts = peak.shape[0]
    for part in prange(parts):
        own = peak[part]
        for k in range(count * part // parts, count * (part + 1) // parts):
            p = rays[k]
            through = np.float32(1.0)
            for n in range(layers):
                if codes[p, n, 0] == 0:
                    continue
                j, b = _corner(codes[p, n, 0], width)
                i, a = _corner(codes[p, n, 1], height)
                alpha = np.float32(0.0)
                for tap in range(4):
                    di, dj = tap >> 1, tap & 1
                    w = (a if di else 1 - a) * (b if dj else 1 - b) * texture[i + di, j + dj, n, 3]
                    alpha += w
                    own[i + di, j + dj, n] = max(own[i + di, j + dj, n], through * w)
                through *= 1 - alpha
                if through < OPAQUE:
                    break
