"""Mend what a killed DVC leaves.

It rewrites `dvc.lock` and `.dvc/tmp/rwlock` in place, and for some 20 ms they are empty. Every later `dvc repro` then
stops ("validation failed", "JSON structure is corrupted"). Without the files it goes on: it takes from its cache what
the stages had made, and makes the files anew.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from facefolds_core.errors import UserError
from facefolds_core.system.locks import holding

PATIENCE = 5.0
"""Seconds to wait for a DVC that is at work."""


def mend(root: Path) -> list[str]:
    """Move damaged files of DVC out of its way; a line for each. Whole ones are never touched.

    Args:
        root: the project's folder.

    Raises:
        UserError: if a running DVC is writing them.
    """
    tmp = root / ".dvc" / "tmp"
    lines = []
    for path, guard, is_whole in (
        (root / "dvc.lock", tmp / "lock", is_lockfile),
        (tmp / "rwlock", tmp / "rwlock.lock", is_rwlock),
    ):
        if not path.is_file() or is_whole(path):
            continue
        with holding(guard, PATIENCE) as free:  # one of DVC's own locks
            if not free:
                message = "DVC is at work in this folder, so its files were not looked at"
                raise UserError(message, file=guard, remedy="let it end, and run the same command again")
            if path.is_file() and not is_whole(path):  # DVC may have written it meanwhile
                lines.append(_move_away(path))
    return lines


def is_lockfile(path: Path) -> bool:
    """Whether DVC accepts it as a `dvc.lock`."""
    # DVC takes a while to import: only now. Without it nobody reads the file.
    try:
        from dvc.dvcfile import Lockfile
        from dvc.exceptions import DvcException
        from dvc.utils.serialize import parse_yaml
    except ModuleNotFoundError:
        return True
    try:
        Lockfile.validate(parse_yaml(path.read_text(encoding="utf-8"), path), str(path))
    except (DvcException, UnicodeDecodeError, RecursionError):
        return False
    return True


def is_rwlock(path: Path) -> bool:
    """Whether DVC accepts it as its list of files in use."""
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return False
    return isinstance(value, dict) and all(isinstance(value.get(key, {}), dict) for key in ("read", "write"))


def _move_away(path: Path) -> str:
    """Rename a file, so that nothing that it holds is lost. What was done, in words."""
    aside = path.with_name(f"{path.name}.damaged-{time.time_ns()}")
    path.rename(aside)
    rest = "; `dvc repro` makes it anew and takes finished stages from its cache" if path.name == "dvc.lock" else ""
    return f"{os.path.relpath(path)} was damaged, as a DVC that was killed leaves it: it is {aside.name} now{rest}"
