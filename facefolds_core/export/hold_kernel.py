"""How much each texel shows, and keeping it still where a change would not: compiled for CPUs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange

from facefolds_core.kernels.hit_codes import corner
from facefolds_core.kernels.jit import compiled, inlined, kernel
from facefolds_core.kernels.scatter import BLOCK, CHUNK, scatter_of, spread

_scatter = scatter_of(2)


@inlined
def _tap(texture, n, i, j, q, a, b):  # type: ignore[no-untyped-def]
    one = np.float32(1.0)
    top = texture[n, i, j, q] * (one - b) + texture[n, i, j + 1, q] * b
    bottom = texture[n, i + 1, j, q] * (one - b) + texture[n, i + 1, j + 1, q] * b
    return top * (one - a) + bottom * a


@kernel(parallel=True)
def add_weights(codes, texture, sums, min_light):  # type: ignore[no-untyped-def]
    """Adds to each texel's sums, over all rays, share * d_n sum_m d_m: for colour and for alpha.

    d_n is the length of the derivative of the ray's colour over black (mean of RGB) by what is looked up in layer n, in
    the texture's unit; the share is the texel's in the bilinear look-up. Since (sum_n d_n e_n)^2 <= sum_m d_m sum_n d_n
    e_n^2, errors e weighted with it are at least the ray's, also where all layers err alike (De Pierro 1995).

    codes (P, N, 2) uint16, texture (N, H, W, 4) in [0, 255], sums (N, H, W, 2) float32. Layers behind less
    transmittance than `min_light` are left out.
    """
    layers, count = texture.shape[0], codes.shape[0]
    index = np.empty((layers, CHUNK), np.int32)
    wish = np.empty((layers, CHUNK, 4), np.float32)
    for start in range(0, count, CHUNK):
        own = min(CHUNK, count - start)
        for block in prange((own + BLOCK - 1) // BLOCK):
            first, last = block * BLOCK, min((block + 1) * BLOCK, own)
            _weigh(codes[start + first : start + last], texture, min_light, index[:, first:last], wish[:, first:last])
        for task in prange(layers):
            n = spread(task, layers)
            _scatter(index[n, :own], wish[n, :own], sums[n])


@compiled
def _weigh(codes: Any, texture: Any, min_light: Any, index: Any, wish: Any) -> None:
    """A block of R rays: index (N, R) and wish (N, R, 4) as `scatter` takes them."""
    height, width, layers = texture.shape[1], texture.shape[2], texture.shape[0]
    scale, one, zero = np.float32(1 / 255.0), np.float32(1.0), np.float32(0.0)
    layer = np.empty(layers, np.int64)
    before, c = np.empty(layers, np.float32), np.empty((layers, 4), np.float32)
    for p in range(codes.shape[0]):
        through, m = one, 0
        for n in range(layers):
            index[n, p] = -1
        for n in range(layers):
            if codes[p, n, 0] == 0:
                continue
            j, b = corner(codes[p, n, 0], width)
            i, a = corner(codes[p, n, 1], height)
            index[n, p] = i * width + j
            wish[n, p, 0], wish[n, p, 1] = a, b
            layer[m], before[m] = n, through
            for q in range(4):
                c[m, q] = _tap(texture, n, i, j, q, a, b) * scale
            through *= one - c[m, 3]
            m += 1
            if through < min_light:
                break
        s0, s1, s2, all_colour, all_alpha = zero, zero, zero, zero, zero
        for q in range(m - 1, -1, -1):
            n = layer[q]
            g0, g1, g2 = c[q, 0] - s0, c[q, 1] - s1, c[q, 2] - s2
            wish[n, p, 2] = before[q] * c[q, 3]
            wish[n, p, 3] = before[q] * np.sqrt((g0 * g0 + g1 * g1 + g2 * g2) * np.float32(1 / 3.0))
            all_colour += wish[n, p, 2]
            all_alpha += wish[n, p, 3]
            s0, s1, s2 = s0 + c[q, 3] * g0, s1 + c[q, 3] * g1, s2 + c[q, 3] * g2
        for q in range(m):
            wish[layer[q], p, 2] *= all_colour
            wish[layer[q], p, 3] *= all_alpha


@kernel
def pieces(y, price, best, first):  # type: ignore[no-untyped-def]
    """y (K, Q) becomes argmin_x 1/2 sum |x_k - y_k|^2 + price * (how many k have x_k != x_(k-1)), in place.

    The Potts functional, by dynamic programming (Friedrich, Kempe, Liebscher, Winkler 2008): best[t] is the least cost
    of the first t frames, first[t] where the last piece of frames 0 to t begins. A piece has its frames' mean.
    best (K + 1,) and first (K,) are scratch.
    """
    count, channels = y.shape
    mean = np.empty(channels)
    best[0] = -price
    for t in range(count):
        best[t + 1] = np.inf
        mean[:] = 0.0
        error = 0.0
        for s in range(t, -1, -1):
            size = t - s + 1
            for q in range(channels):
                off = y[s, q] - mean[q]
                mean[q] += off / size
                error += 0.5 * off * (y[s, q] - mean[q])
            if best[s] + price + error < best[t + 1]:
                best[t + 1], first[t] = best[s] + price + error, s
            if error >= best[t + 1]:
                break
    t = count - 1
    while t >= 0:
        s = first[t]
        for q in range(channels):
            mean[q] = 0.0
            for k in range(s, t + 1):
                mean[q] += y[k, q] / (t - s + 1)
            for k in range(s, t + 1):
                y[k, q] = mean[q]
        t = s - 1


@kernel(parallel=True)
def hold(images, weights, price):  # type: ignore[no-untyped-def]
    """images (K, H, W, 4) uint8, in place: colour and alpha of each texel in `pieces`, at price / weight.

    weights (H, W, 2) float32 of colour and of alpha; a texel without weight keeps its mean.
    """
    count, height, width = images.shape[0], images.shape[1], images.shape[2]
    for row in prange(height):
        colour, alpha = np.empty((count, 3)), np.empty((count, 1))
        best, first = np.empty(count + 1), np.empty(count, np.int64)
        for column in range(width):
            for part in range(2):
                y = colour if part == 0 else alpha
                moves = False
                for k in range(count):
                    for q in range(y.shape[1]):
                        value = images[k, row, column, 3 * part + q]
                        moves |= value != images[0, row, column, 3 * part + q]
                        y[k, q] = value
                if not moves:
                    continue
                pieces(y, price / max(weights[row, column, part], 1e-9), best, first)
                for k in range(count):
                    for q in range(y.shape[1]):
                        images[k, row, column, 3 * part + q] = np.uint8(np.rint(y[k, q]))
