"""What rays add to the texels that they meet, shared out among threads: compiled.

Rays are worked on in chunks. Threads share the rays of a chunk, and note what each ray wants of each layer; then they
share the layers, and each texel takes what is wanted of it in the order of the rays. So one array of sums serves any
number of threads, and the result does not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from facefolds_core.kernels.jit import compiled, inlined

CHUNK = 32768
"""Rays whose wishes are noted at once: few enough for the cache."""

BLOCK = 256
"""Rays that a thread takes at once."""


@inlined
def spread(task, tasks):  # type: ignore[no-untyped-def]
    """A permutation: a thread takes neighbouring tasks, and of neighbouring layers one is met as often as the other."""
    group, size = task % 4, tasks // 4
    return group * size + min(group, tasks % 4) + task // 4


@inlined
def _add4(sums, i, j, v0, v1, v2, v3):  # type: ignore[no-untyped-def]
    """Add to four sums; all are read before one is written, so that they go at once."""
    s0, s1, s2, s3 = sums[i, j, 0], sums[i, j, 1], sums[i, j, 2], sums[i, j, 3]
    sums[i, j, 0] = s0 + v0
    sums[i, j, 1] = s1 + v1
    sums[i, j, 2] = s2 + v2
    sums[i, j, 3] = s3 + v3


def scatter_of(values: int) -> Callable[[Any, Any, Any], None]:
    """A compiled function that adds what R rays want of one layer to its sums, bilinear.

    Its arguments: index (R,), the texel before each ray's crossing as row width + column, or -1; wish (R, 2 + values),
    fractions of row and column and what is to be added; the sums (H, W, values).
    """

    @inlined
    def put(texel: Any, wish: Any, k: Any, sums: Any) -> None:
        width = sums.shape[1]
        one = np.float32(1.0)
        i, j = texel // width, texel % width
        a, b = wish[k, 0], wish[k, 1]
        for tap in range(4):
            di, dj = tap >> 1, tap & 1
            w = (a if di else one - a) * (b if dj else one - b)
            for q in range(values):
                sums[i + di, j + dj, q] += w * wish[k, 2 + q]

    @inlined
    def put4(texel: Any, wish: Any, k: Any, sums: Any) -> None:
        i, j = np.uint64(texel // sums.shape[1]), np.uint64(texel % sums.shape[1])
        one, next_one = np.float32(1.0), np.uint64(1)
        # All is read before anything is written: for all a compiler knows, the wishes may lie in the sums.
        a, b, g0, g1, g2, g3 = wish[k, 0], wish[k, 1], wish[k, 2], wish[k, 3], wish[k, 4], wish[k, 5]
        w = (one - a) * (one - b)
        _add4(sums, i, j, w * g0, w * g1, w * g2, w * g3)
        w = (one - a) * b
        _add4(sums, i, j + next_one, w * g0, w * g1, w * g2, w * g3)
        w = a * (one - b)
        _add4(sums, i + next_one, j, w * g0, w * g1, w * g2, w * g3)
        w = a * b
        _add4(sums, i + next_one, j + next_one, w * g0, w * g1, w * g2, w * g3)

    put_one = put4 if values == 4 else put

    @compiled
    def scatter(index: Any, wish: Any, sums: Any) -> None:
        for k in range(index.shape[0]):
            if index[k] >= 0:
                put_one(index[k], wish, k, sums)

    return scatter
