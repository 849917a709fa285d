"""Processes that are started: their environment, and that they end with the one that started them."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from pathlib import Path

import psutil

THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables of the environment that say how many threads a process may have."""

OPENBLAS = "OPENBLAS_NUM_THREADS"
"""The same of numpy's and scipy's linear algebra: one is best, however many cores there are (stages/__init__.py)."""

LOOK = 0.25
"""Seconds between two looks at the parent's process."""

GRACE = 10.0
"""Seconds that a process may clean up after its parent ended, before it is killed."""


def with_threads(count: int) -> dict[str, str]:
    """Variables of the environment for a process with so many threads."""
    return {**dict.fromkeys(THREADS, str(count)), OPENBLAS: "1"}


def own_environment(**more: str) -> dict[str, str]:
    """The environment, in which the programs beside this Python are found first, and `more`."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    return {**os.environ, "PATH": path, **more}


def end_with_parent() -> None:
    """End this process when its parent has ended: nobody else waits for what it makes.

    A thread looks; Linux' PR_SET_PDEATHSIG would be sent when the thread that started us ends, not its process, and
    not at all where a shell stands between.
    """
    parent = psutil.Process().parent()
    if parent is None:
        return
    chain = [(psutil.Process(), parent.pid)]
    try:
        if "-c" in parent.cmdline()[1:] and (above := parent.ppid()):  # a shell that waits for us
            chain.append((parent, above))
    except psutil.Error:
        pass  # it ended just now: the thread sees it
    threading.Thread(target=_watch, args=(chain,), daemon=True, name="end with parent").start()


def _watch(chain: list[tuple[psutil.Process, int]]) -> None:
    """Wait until a process of `chain` has another parent than the one noted, which has ended; then end this one."""
    while all(_parent(child) == pid for child, pid in chain):
        time.sleep(LOOK)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os.kill(os.getpid(), signal.SIGKILL)


def _parent(process: psutil.Process) -> int:
    try:
        return int(process.ppid())
    except psutil.Error:
        return -1
