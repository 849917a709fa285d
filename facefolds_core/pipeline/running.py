"""A stage's work, run once at a time on a subject, and timed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_json
from facefolds_core.system.locks import holding, owner

Work = Callable[[SubjectFolders], str]
"""Does a stage's work on one subject's folders, and says in a line what was made and where; more lines may follow."""

LOCK_WAIT = 20.0
"""Seconds that a stage waits for another run of it, which may be ending, on the same subject."""


def run_alone(name: str, work: Work, folders: SubjectFolders) -> str:
    """Do a stage's work while no other run of it is at work on the subject, and write how long it took.

    Returns:
        lines that say what was made, where, and in how many seconds.

    Raises:
        UserError: as the work does, or if another run is at work.
    """
    with alone(name, folders.root / "locks"):
        start = time.perf_counter()
        said, *more = work(folders).splitlines()
        seconds = time.perf_counter() - start
        write_json(folders.timing(name), {"stage": name, "seconds": round(seconds, 3)})
    return "\n".join([f"{name}: {said} ({seconds:.1f} s)", *more])


@contextmanager
def alone(name: str, locks: Path) -> Iterator[None]:
    """Keep a second run of the stage out while the block runs.

    Args:
        locks: folder of the locks: a subject's, or that of all subjects.

    Raises:
        UserError: if another run is at work, and does not end within LOCK_WAIT.
    """
    path = locks / name
    with holding(path, LOCK_WAIT) as free:
        if not free:
            raise UserError(
                f"another run of {name} is at work: {owner(path)}",
                file=path,
                remedy="let it end, or end it, and run the same command again",
            )
        yield
