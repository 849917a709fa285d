"""Numba's threads in a block."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import numba

T = TypeVar("T")


@contextmanager
def on_threads(count: int) -> Iterator[None]:
    """Kernels in the block compute on so many threads, or on as many as there are."""
    before = numba.get_num_threads()
    numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))
    try:
        yield
    finally:
        numba.set_num_threads(before)


def each_of(counts: tuple[int, ...], work: Callable[[], T]) -> list[T]:
    """What is computed on each of these numbers of threads."""
    found = []
    for count in counts:
        with on_threads(count):
            found.append(work())
    return found
