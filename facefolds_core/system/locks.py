"""Locks that the kernel lets go when their owner ends, however it ends: a killed process never blocks the next one."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nothing is locked
    fcntl = None  # type: ignore[assignment]

WAIT = 0.1
"""Seconds between two tries."""

_HELD = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)


def try_lock(path: Path, create: bool = True) -> FileIO | None:
    """Lock a file until what is returned is closed, or this process ends; None if another one holds it.

    Its content is left alone.

    On file systems that know no locks the answer is a lock that keeps nobody out.

    Raises:
        OSError: if the file cannot be opened, or is not there and `create` is False.
    """
    handle = os.open(path, os.O_RDWR | os.O_CLOEXEC | (os.O_CREAT if create else 0), 0o666)
    try:
        if fcntl is not None:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _HELD:
            os.close(handle)
            return None
    return FileIO(handle, "r+")


@contextmanager
def holding(path: Path, seconds: float) -> Iterator[bool]:
    """Hold the lock on `path` in the block, which learns whether it was had within `seconds`.

    While it is held the file names the owner's process.
    """
    deadline = time.monotonic() + seconds
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = try_lock(path)
    while lock is None and time.monotonic() < deadline:
        time.sleep(WAIT)
        lock = try_lock(path)
    if lock is None:
        yield False
        return
    try:
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n".encode())
        yield True
    finally:
        lock.close()


def owner(path: Path) -> str:
    """The process that the lock file names, in words."""
    try:
        return f"process {int(path.read_text(encoding='utf-8'))}"
    except (OSError, ValueError):
        return "another process"
