"""What the fit of the shared reflection asks of stored crossings, compiled. Plain torch: `model.reflection`; tests
compare. No sum here is shared out among threads."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange

from facefolds_core.kernels.hit_codes import SCALE, corner
from facefolds_core.kernels.jit import compiled, inlined, kernel
from facefolds_core.training.explicit.shading_kernel import difference, rgb_tap, rgba_tap


@kernel(parallel=True)
def look(codes, camera, pixel, cut, behind, texture, seen, min_light):  # type: ignore[no-untyped-def]
    """Adds to seen (P, 6) of each ray, in one frame: I - C (3), opacity, and opacity times (s, t).

    Arguments as of `shading_kernel.shade`; C without reflections.
    """
    height, width, layers = texture.shape[0], texture.shape[1], texture.shape[2]
    one, zero = np.float32(1.0), np.float32(0.0)
    for p in prange(codes.shape[0]):
        through, r0, r1, r2, s, t = one, zero, zero, zero, zero, zero
        for n in range(layers):
            if codes[p, n, 0] == 0:
                continue
            j, b = corner(codes[p, n, 0], width)
            i, a = corner(codes[p, n, 1], height)
            row, column, of = np.uint64(i), np.uint64(j), np.uint64(n)
            light = through * rgba_tap(texture, row, column, of, 3, a, b)
            c0, c1, c2 = rgb_tap(texture, row, column, of, a, b)
            r0, r1, r2 = r0 + light * c0, r1 + light * c1, r2 + light * c2
            s += light * (np.float32(codes[p, n, 0]) - one) / np.float32(SCALE)
            t += light * (np.float32(codes[p, n, 1]) - one) / np.float32(SCALE)
            through -= light
            if through < min_light:
                break
        d0, d1, d2 = difference(cut, behind, camera[p], pixel[p], r0, r1, r2, through)
        seen[p, 0] -= d0
        seen[p, 1] -= d1
        seen[p, 2] -= d2
        seen[p, 3] += one - through
        seen[p, 4] += s
        seen[p, 5] += t


@inlined
def _texel(x, size):  # type: ignore[no-untyped-def]
    """Place in [0, 1] -> index of the texel before it, and the fraction beyond its centre; clamped."""
    at = min(max(x * np.float32(size) - np.float32(0.5), np.float32(0.0)), np.float32(size - 1))
    i = min(int(at), size - 2)
    return i, np.float32(at - i)


@inlined
def _value(image, i, j, q, a, b):  # type: ignore[no-untyped-def]
    one = np.float32(1.0)
    top = image[i, j, q] * (one - b) + image[i, j + 1, q] * b
    bottom = image[i + 1, j, q] * (one - b) + image[i + 1, j + 1, q] * b
    return top * (one - a) + bottom * a


@inlined
def _mirrored(st, directions, normals, p):  # type: ignore[no-untyped-def]
    """Direction in which ray p goes on where it meets the surface; of unit length."""
    j, b = _texel(st[p, 0], normals.shape[1])
    i, a = _texel(st[p, 1], normals.shape[0])
    x, y, z = (_value(normals, i, j, 0, a, b), _value(normals, i, j, 1, a, b), _value(normals, i, j, 2, a, b))
    dx, dy, dz = directions[p, 0], directions[p, 1], directions[p, 2]
    along = 2 * min(dx * x + dy * y + dz * z, np.float32(0.0)) / (x * x + y * y + z * z)
    return dx - along * x, dy - along * y, dz - along * z


@kernel(parallel=True)
def reflect(st, directions, turns, normals, out):  # type: ignore[no-untyped-def]
    """out (P, 2): where in the environment what reflects at st (P, 2), seen along directions (P, 3), lies.

    turns (P, 3, 3) of each ray from its axes to those that the environment is fixed to, None: they are the same.
    normals (h, w, 3). All float32."""
    for p in prange(st.shape[0]):
        x, y, z = _mirrored(st, directions, normals, p)
        front, left, up = _turned(turns, p, x, y, z)
        scale = np.float32(0.5) / np.sqrt(max(2 * (1 + front), np.float32(1e-6)))
        out[p, 0] = np.float32(0.5) + scale * left
        out[p, 1] = np.float32(0.5) - scale * up


@compiled
def _turned(turns: Any, p: Any, x: Any, y: Any, z: Any) -> Any:
    if turns is None:
        return x, y, z
    t = turns[p]
    return (
        t[0, 0] * x + t[0, 1] * y + t[0, 2] * z,
        t[1, 0] * x + t[1, 1] * y + t[1, 2] * z,
        t[2, 0] * x + t[2, 1] * y + t[2, 2] * z,
    )


@kernel(parallel=True)
def sample(image, st, out):  # type: ignore[no-untyped-def]
    """out (P, C): image (h, w, C) at st (P, 2), bilinear, clamped."""
    for p in prange(st.shape[0]):
        j, b = _texel(st[p, 0], image.shape[1])
        i, a = _texel(st[p, 1], image.shape[0])
        for q in range(image.shape[2]):
            out[p, q] = _value(image, i, j, q, a, b)


@kernel
def normal_equations(st: Any, weight: Any, wish: Any, height: Any, width: Any, band: Any, right: Any) -> None:
    """Adds to band (w + 2, h w) and right (h w, C), float64, the normal equations of a grid's values x with
    sum_p weight_p |x(st_p)|^2 - 2 x(st_p) . wish_p least; x(st) bilinear.

    band is the lower part of the matrix as scipy's `solveh_banded` takes it. st (P, 2), weight (P,), wish (P, C)."""
    for p in range(st.shape[0]):
        if weight[p] == 0:
            continue
        j, b = _texel(st[p, 0], width)
        i, a = _texel(st[p, 1], height)
        for one_of in range(4):
            di, dj = one_of >> 1, one_of & 1
            own = (a if di else 1 - a) * (b if dj else 1 - b)
            at = (i + di) * width + j + dj
            for q in range(wish.shape[1]):
                right[at, q] += own * wish[p, q]
            for other in range(one_of + 1):
                oi, oj = other >> 1, other & 1
                theirs = (a if oi else 1 - a) * (b if oj else 1 - b)
                before = (i + oi) * width + j + oj
                band[at - before, before] += own * theirs * weight[p]
