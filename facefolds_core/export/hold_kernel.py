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
    """Adds to each texel's sums, over all rays, share * (dC/dcolour)^2 and share * |dC/dalpha|^2 / 3.

    C is a ray's colour over black, in the texture's unit; the share is the texel's in the bilinear look-up, and the
    derivatives are those by the value looked up.

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
        s0, s1, s2 = zero, zero, zero
        for q in range(m - 1, -1, -1):
            n = layer[q]
            g0, g1, g2 = c[q, 0] - s0, c[q, 1] - s1, c[q, 2] - s2
            wish[n, p, 2] = (before[q] * c[q, 3]) ** 2
            wish[n, p, 3] = before[q] ** 2 * (g0 * g0 + g1 * g1 + g2 * g2) * np.float32(1 / 3.0)
            s0, s1, s2 = s0 + c[q, 3] * g0, s1 + c[q, 3] * g1, s2 + c[q, 3] * g2


@inlined
def _fill(x, first, last, value):  # type: ignore[no-untyped-def]
    for i in range(first, last + 1):
        x[i] = value
    return last + 1


@kernel
def steady(y, price, x):  # type: ignore[no-untyped-def]
    """x = argmin 1/2 sum (x_k - y_k)^2 + price sum |x_k - x_(k-1)|: Condat 2013, direct, (K,) each.

    A segment from `start` on grows while a constant can explain it: its value lies in [low, high], and `under`, `over`
    are the sums of what these leave. Where they leave more than the price, the segment ends with a jump.
    """
    last = len(y) - 1
    k, start, fell, rose = 0, 0, 0, 0
    low, high, under, over = y[0] - price, y[0] + price, price, -price
    while True:
        if k == last:
            if under < 0.0:
                start = _fill(x, start, fell, low)
                k = fell = start
                low, under = y[k], price
                over = low + price - high
            elif over > 0.0:
                start = _fill(x, start, rose, high)
                k = rose = start
                high, over = y[k], -price
                under = high - price - low
            else:
                _fill(x, start, last, low + under / (k - start + 1))
                return
            continue
        under += y[k + 1] - low
        over += y[k + 1] - high
        if under < -price:
            start = _fill(x, start, fell, low)
            k = fell = rose = start
            low, under, over = y[k], price, -price
            high = low + 2 * price
        elif over > price:
            start = _fill(x, start, rose, high)
            k = fell = rose = start
            high, under, over = y[k], price, -price
            low = high - 2 * price
        else:
            k += 1
            if under >= price:
                fell = k
                low += (under - price) / (fell - start + 1)
                under = price
            if over <= -price:
                rose = k
                high += (over + price) / (rose - start + 1)
                over = -price


@kernel(parallel=True)
def hold(images, weights, price):  # type: ignore[no-untyped-def]
    """images (K, H, W, 4) uint8, in place: each channel of each texel `steady` in time, at price / weight.

    weights (H, W, 2) float32 of colour and of alpha; a texel without weight keeps its mean.
    """
    count, height, width = images.shape[0], images.shape[1], images.shape[2]
    for row in prange(height):
        y, x = np.empty(count), np.empty(count)
        for column in range(width):
            for q in range(4):
                least, greatest = images[0, row, column, q], images[0, row, column, q]
                for k in range(count):
                    value = images[k, row, column, q]
                    least, greatest = min(least, value), max(greatest, value)
                    y[k] = value
                if least == greatest:
                    continue
                w = weights[row, column, 0 if q < 3 else 1]
                steady(y, price / max(w, 1e-9), x)
                for k in range(count):
                    images[k, row, column, q] = np.uint8(np.rint(min(max(x[k], 0.0), 255.0)))
