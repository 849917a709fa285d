"""Arrays too large for memory: they lie in files without a name, which the system gives back."""

from __future__ import annotations

import mmap
import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

IN_MEMORY = 1 << 23
"""Bytes of an array that stay in memory."""

ROWS = 16
"""Of a larger one, that are worked on at a time."""

ALIGNED = 64
"""Bytes at whose multiples arrays of one file begin."""


def spill_folder() -> Path:
    """Where files lie: `TMPDIR`; else /var/tmp, since /tmp is memory on many systems."""
    large = Path("/var/tmp")
    return large if "TMPDIR" not in os.environ and os.access(large, os.W_OK) else Path(gettempdir())


def spilled_together(arrays: Mapping[str, NDArray[Any]], reserve: float) -> dict[str, NDArray[Any]] | None:
    """The same arrays, of whatever size, in one file; None if less than `reserve` bytes would stay free beside it."""
    starts, size = {}, 0
    for name, array in arrays.items():
        starts[name] = size
        size += -(-array.nbytes // ALIGNED) * ALIGNED
    if not size:
        return dict(arrays)
    if shutil.disk_usage(spill_folder()).free - size < reserve:
        return None
    try:
        with TemporaryFile(dir=spill_folder()) as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)  # a file with holes ends the process where the disk is full
            else:
                file.truncate(size)
            whole = mmap.mmap(file.fileno(), size)
    except OSError:
        return None
    found = {}
    for name, array in arrays.items():
        flat = np.frombuffer(whole, array.dtype, array.size, starts[name])
        found[name] = flat.reshape(array.shape)
        found[name][:] = array
    return found


def spilled(shape: tuple[int, ...], dtype: DTypeLike = float) -> NDArray[Any]:
    """An empty array; a large one in a temporary file that is gone with it."""
    if int(np.prod(shape)) * np.dtype(dtype).itemsize <= IN_MEMORY:
        return np.empty(shape, dtype)
    with TemporaryFile(dir=spill_folder()) as file:
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
