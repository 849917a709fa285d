"""Threads keep the scheduling policy that they have."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_THREADS = Path("/proc/self/task")


@contextmanager
def kept_scheduling() -> Iterator[None]:
    """Undo what the block does to the scheduling of this thread, and give threads that it starts the same (Linux).

    SVT-AV1, when root runs it, makes the thread that opens an encoder real-time (SCHED_FIFO, priority 99), which its
    threads and later every child process inherit: numba's threads, DVC's stages, a browser. Two of them that spin then
    starve the whole machine.
    """
    if sys.platform != "linux":
        yield
        return
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    before = set(_threads())
    try:
        yield
    finally:
        for thread in [0, *(set(_threads()) - before)]:
            with suppress(ProcessLookupError):  # it ended meanwhile
                os.sched_setscheduler(thread, policy, parameters)


def _threads() -> list[int]:
    return [int(entry.name) for entry in _THREADS.iterdir()]
