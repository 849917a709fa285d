"""A full disk at the end of a training: wait for space rather than lose what was trained."""

from __future__ import annotations

import errno
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from facefolds_core.errors import UserError

T = TypeVar("T")

SECONDS = 900.0
"""How long a full disk is waited for."""

EVERY = 5.0
"""Seconds between two tries."""

_FULL = (errno.ENOSPC, errno.EDQUOT)


def is_full(error: OSError) -> bool:
    """Whether there is no room on the disk, or a quota is used up."""
    return error.errno in _FULL


def patiently(write: Callable[[], T]) -> T:
    """Call `write`; while the disk is full, say so once and call it again, for SECONDS at most.

    Args:
        write: leaves nothing behind when it fails.

    Raises:
        OSError: of the last try; every other error at once.
    """
    deadline, told = time.monotonic() + SECONDS, False
    while True:
        try:
            return write()
        except OSError as error:
            if not is_full(error) or time.monotonic() >= deadline:
                raise
            if not told:
                sys.stderr.write(
                    f"\ntrain: the disk is full ({error.filename}): free some space on it. What is trained is kept in "
                    f"memory, and written as soon as there is room; after {SECONDS / 60:.0f} minutes it is given up\n"
                )
                told = True
        time.sleep(EVERY)


def check_space(folder: Path, needed: int) -> None:
    """Refuse to train what could not be written.

    Args:
        folder: of the model.
        needed: bytes.

    Raises:
        UserError: if there is less space on the disk.
    """
    there = next(path for path in folder.absolute().parents if path.exists())
    free = shutil.disk_usage(there).free
    if free < needed:
        raise UserError(
            "the trained model would not fit on the disk",
            file=folder,
            expected=f"{needed / 1e6:.0f} MB of free space",
            found=f"{free / 1e6:.0f} MB",
            remedy="free some space and run the same command again; finished stages are kept",
        )
