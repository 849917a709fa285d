"""DVC's record of what ran, kept usable where a DVC was killed."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

SETTLED = 1.0
"""Seconds after which a folder that is still empty stays so: DVC makes it and writes its file at once."""


def drop_empty_runs(cache: Path) -> None:
    """Remove empty folders of the run cache, over which every later DVC stumbles: "join() argument must be str".

    A DVC that is killed between making the folder of an entry and writing it leaves one (dvc/stage/cache.py, 3.x:
    `_load` takes the newest file of a folder, and there is none).

    Args:
        cache: DVC's cache folder, which need not exist.
    """
    for folder in (cache / "runs").glob("??/*"):
        with suppress(OSError):  # it holds entries, as all others do, or is gone
            if time.time() - folder.stat().st_mtime > SETTLED:
                folder.rmdir()
