"""Shading of stored crossings, forwards and backwards, compiled. Reference: `tests/training/reference.py`.

For how threads share the work see `facefolds_core.kernels.scatter`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.kernels.hit_codes import corner
from facefolds_core.kernels.jit import compiled, inlined, kernel
from facefolds_core.kernels.scatter import BLOCK, CHUNK, scatter_of, spread

Array = NDArray[Any]

PRICE = 0.1
"""Of the opacity of a ray whose pixel shows nothing of the subject: squared errors alone hardly ask thin opacity to go.
On cameras left out, any background: actor with 8 cameras +0.4 dB, `sparse` +0.2, actor with 20 cameras -0.05."""

CLEAREST = 1e-6
"""Least transmittance of a layer that is divided by."""

_scatter = scatter_of(4)


@inlined
def rgba_tap(texture, i, j, n, q, a, b):  # type: ignore[no-untyped-def]
    """Channel q of layer n, bilinear, between the texels (i, j) and (i + 1, j + 1).

    i, j, n are uint64: numba then need not ask whether an index counts from the end.
    """
    one, i1, j1 = np.float32(1.0), i + np.uint64(1), j + np.uint64(1)
    top = texture[i, j, n, q] * (one - b) + texture[i, j1, n, q] * b
    bottom = texture[i1, j, n, q] * (one - b) + texture[i1, j1, n, q] * b
    return top * (one - a) + bottom * a


@inlined
def rgb_tap(texture, i, j, n, a, b):  # type: ignore[no-untyped-def]
    """The three colours, as `rgba_tap`."""
    r, g = rgba_tap(texture, i, j, n, 0, a, b), rgba_tap(texture, i, j, n, 1, a, b)
    return r, g, rgba_tap(texture, i, j, n, 2, a, b)


@inlined
def difference(cut, behind, cam, pix, r0, r1, r2, transmittance):  # type: ignore[no-untyped-def]
    """C - I of a ray through a pixel: what its layers show, r + T g, less what is cut out, F + (1 - m) g.

    cut (C, H W, 4) uint8: F and m; behind (C, 4): g, or the mean of several."""
    inverse = np.float32(1 / 255.0)
    clear = transmittance - np.float32(255 - cut[cam, pix, 3]) * inverse
    d0 = r0 + clear * behind[cam, 0] - cut[cam, pix, 0] * inverse
    d1 = r1 + clear * behind[cam, 1] - cut[cam, pix, 1] * inverse
    d2 = r2 + clear * behind[cam, 2] - cut[cam, pix, 2] * inverse
    return d0, d1, d2


@kernel(parallel=True)
def shade(  # type: ignore[no-untyped-def]
    codes,  # (P, N, 2) uint16 (`hit_codes`): crossings of the ray through each pixel's centre with each layer
    finer,  # (Q, S, N, 2), of S rays spread over a pixel
    which,  # (P,) int32, which of the Q a pixel has in place of the ray through its centre, or -1
    camera,  # (P,) int32
    pixel,  # (P,) int32
    rays,  # (R,) int64, which of the P to shade, none twice
    cut,  # (C, H W, 4) uint8, the subject cut out: colours F times opacity m, and m
    behind,  # (C, 4) float32, of the colours g behind it and behind the layers: their mean, and v, their variances' sum
    texture,  # (H, W, N, 4) rgb and alpha in [0, 1]
    shine,  # (P, 3) float32, added to the colours that a pixel's rays meet; (0, 3) for none
    gradient,  # (N, H, W, 4), added to
    min_alpha,  # layers with less alpha are left out
    min_light,  # layers behind less transmittance are left out
    shares,  # whether `gradient` gets w (C - I) and w in place of its gradient; w: what a texel adds to a ray's colour
):
    """Differentiates the sum over pixels of 0.5 |C - I|^2: I = F + (1 - m) g, and C the mean over a pixel's rays of
    sum_i w_i c_i + T g; T is the transmittance. Its mean over the colours g is that of their mean, and v (T - 1 + m)^2
    more. Where m = 0, `PRICE` (1 - T) is added.

    Adds the gradient to `gradient`; returns the sum of |C - I|^2.
    """
    layers, count, room = texture.shape[2], rays.shape[0], BLOCK * max(1, finer.shape[1])
    squares = np.zeros((count + BLOCK - 1) // BLOCK)
    blocks = CHUNK // BLOCK
    index = np.empty((layers, blocks * room), np.int32)
    wish = np.empty((layers, blocks * room, 6), np.float32)
    terms = np.float32(min_alpha), min_light, shares
    for start in range(0, count, CHUNK):
        own = (min(CHUNK, count - start) + BLOCK - 1) // BLOCK
        for block in prange(own):
            first, last = start + block * BLOCK, min(start + (block + 1) * BLOCK, count)
            squares[start // BLOCK + block] = _shade(
                codes,
                finer,
                which,
                camera,
                pixel,
                rays[first:last],
                cut,
                behind,
                texture,
                shine,
                terms,
                index[:, block * room : (block + 1) * room],
                wish[:, block * room : (block + 1) * room],
            )
        for task in prange(layers):
            n = spread(task, layers)
            _scatter(index[n, : own * room], wish[n, : own * room], gradient[n])
    total = 0.0  # not squares.sum(), which numba shares out among the threads
    for block in range(squares.shape[0]):
        total += squares[block]
    return total


@compiled
def _shade(
    codes: Any,
    finer: Any,
    which: Any,
    camera: Any,
    pixel: Any,
    rays: Any,
    cut: Any,
    behind: Any,
    texture: Any,
    shine: Any,
    terms: Any,
    index: Any,
    wish: Any,
) -> Any:
    """A block of R pixels: the texels before the crossings of their rays in index (N, R'), -1 where there is none, and
    what is wanted there in wish (N, R', 6): fractions of row and column, gradient of rgba (`shares`: w (C - I), and w).
    Returns the sum of |C - I|^2."""
    layers, most, shares = texture.shape[2], max(1, finer.shape[1]), terms[2]
    one, zero = np.float32(1.0), np.float32(0.0)
    layer, count = np.empty((most, layers), np.int64), np.empty(most, np.int64)
    c, before = np.empty((most, layers, 4), np.float32), np.empty((most, layers), np.float32)
    total, k = 0.0, 0
    for p in rays:
        through = codes[p : p + 1] if which[p] < 0 else finer[which[p]]
        samples = through.shape[0]
        share = one / np.float32(samples)
        light, r0, r1, r2 = zero, zero, zero, zero
        for s in range(samples):
            own = layer[s], c[s], before[s]
            m, t, a0, a1, a2 = _meet(k + s, p, through[s], texture, shine, terms, index, wish, own)
            count[s] = m
            light, r0, r1, r2 = light + share * t, r0 + share * a0, r1 + share * a1, r2 + share * a2
        cam, pix = camera[p], pixel[p]
        d0, d1, d2 = difference(cut, behind, cam, pix, r0, r1, r2, light)
        off = light - np.float32(255 - cut[cam, pix, 3]) * np.float32(1 / 255.0)
        price = (zero if cut[cam, pix, 3] > 0 else np.float32(PRICE)) - behind[cam, 3] * off  # of opacity
        price = zero if shares else price
        factor = one if shares else share
        for s in range(samples):
            m, at, left = count[s], k + s, one
            if m > 0:
                left = before[s, m - 1] * (one - c[s, m - 1, 3])
            s0, s1, s2 = behind[cam, 0], behind[cam, 1], behind[cam, 2]
            # From the back: s is the colour of all that lies behind layer q.
            for q in range(m - 1, -1, -1):
                n, alpha, w = layer[s, q], c[s, q, 3], factor * before[s, q]
                g0, g1, g2 = c[s, q, 0] - s0, c[s, q, 1] - s1, c[s, q, 2] - s2
                wish[n, at, 2], wish[n, at, 3], wish[n, at, 4] = w * alpha * d0, w * alpha * d1, w * alpha * d2
                wish[n, at, 5] = w * alpha if shares else w * (d0 * g0 + d1 * g1 + d2 * g2)
                wish[n, at, 5] += factor * price * left / max(one - alpha, np.float32(CLEAREST))
                s0, s1, s2 = s0 + alpha * g0, s1 + alpha * g1, s2 + alpha * g2
        total += d0 * d0 + d1 * d1 + d2 * d2 + behind[cam, 3] * off * off
        k += samples
    index[:, k:] = -1
    return total


@inlined
def _meet(k, p, codes, texture, shine, terms, index, wish, own):  # type: ignore[no-untyped-def]
    """A ray of pixel p, number k of its block, with codes (N, 2), through the layers. Returns how many it meets,
    transmittance, colour."""
    height, width, layers = texture.shape[0], texture.shape[1], texture.shape[2]
    min_alpha, min_light, _ = terms
    one, zero = np.float32(1.0), np.float32(0.0)
    layer, c, before = own
    transmittance, r0, r1, r2 = one, zero, zero, zero
    e0, e1, e2 = zero, zero, zero
    if shine.shape[0] > 0:
        e0, e1, e2 = shine[p, 0], shine[p, 1], shine[p, 2]
    m = 0
    for n in range(layers):
        index[n, k] = -1
    for n in range(layers):
        if codes[n, 0] == 0:
            continue
        column, b = corner(codes[n, 0], width)
        row, a = corner(codes[n, 1], height)
        i, j, of = np.uint64(row), np.uint64(column), np.uint64(n)
        alpha = rgba_tap(texture, i, j, of, 3, a, b)
        if alpha < min_alpha:
            continue
        # All is read before anything is written: for all a compiler knows, scratch may be the texture.
        c0, c1, c2 = rgb_tap(texture, i, j, of, a, b)
        c0, c1, c2 = c0 + e0, c1 + e1, c2 + e2
        index[n, k] = row * width + column
        wish[n, k, 0], wish[n, k, 1] = a, b
        c[m, 0], c[m, 1], c[m, 2], c[m, 3] = c0, c1, c2, alpha
        layer[m], before[m] = n, transmittance
        light = transmittance * alpha
        r0 += light * c0
        r1 += light * c1
        r2 += light * c2
        transmittance *= one - alpha
        m += 1
        if transmittance < min_light:
            break
    return m, transmittance, r0, r1, r2


@inlined
def tap_share(codes, p, n, tap, texture):  # type: ignore[no-untyped-def]
    """Row and column of one of four texels around the crossing of ray p with layer n; bilinear weight times alpha."""
    j, b = corner(codes[p, n, 0], texture.shape[1])
    i, a = corner(codes[p, n, 1], texture.shape[0])
    di, dj = tap >> 1, tap & 1
    w = (a if di else 1 - a) * (b if dj else 1 - b) * texture[i + di, j + dj, n, 3]
    return i + di, j + dj, w
