"""Arrays of a row a frame, too large for memory: they lie in a file without a name, which the system gives back."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

IN_MEMORY = 1 << 23
"""Bytes of an array that stay in memory."""

ROWS = 16
"""Of a larger one, that are worked on at a time."""


def spilled(shape: tuple[int, ...], dtype: DTypeLike = float) -> NDArray[Any]:
    """An empty array; a large one in a temporary file that is gone with it."""
    if int(np.prod(shape)) * np.dtype(dtype).itemsize <= IN_MEMORY:
        return np.empty(shape, dtype)
    with TemporaryFile() as file:
        return np.memmap(file, dtype, "w+", shape=shape).view(np.ndarray)


def running_mean(arrays: Iterable[NDArray[np.float64]]) -> NDArray[np.float64]:
    """`np.mean` of arrays of one shape over all of them, bit for bit, with two in memory; at least one."""
    iterator = iter(arrays)
    total, count = np.array(next(iterator)), 1
    for array in iterator:
        total += array
        count += 1
    return total / count


def by_rows(rows: int, make: Callable[[slice], NDArray[Any]], dtype: DTypeLike = float) -> NDArray[Any]:
    """`make` of all rows: of a large array of a few at a time, which must come to the same.

    Args:
        rows: K, at least 1.
        make: rows -> their part of the array (k, ...).
    """
    first = make(slice(0, 1))
    size = rows * first.nbytes
    step = rows if size <= IN_MEMORY else ROWS
    found = spilled((rows, *first.shape[1:]), dtype)
    for start in range(0, rows, step):
        found[start : start + step] = make(slice(start, start + step))
    return found
