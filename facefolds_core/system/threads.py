"""Work shared out among threads."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")

MOST = 4
"""Threads by default, at most: each holds its work in memory."""


def in_order(work: Iterable[Callable[[], T]], threads: int | None = None) -> Iterator[T]:
    """What functions return, in their order: two a thread are begun before they are asked for. By default a thread a
    core, up to MOST."""
    threads = threads or min(os.cpu_count() or 1, MOST)
    with ThreadPoolExecutor(threads) as pool:
        waiting: deque[Future[T]] = deque()
        try:
            for function in work:
                waiting.append(pool.submit(function))
                if len(waiting) > 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
