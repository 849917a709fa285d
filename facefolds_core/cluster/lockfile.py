"""dvc.lock in parts: what a job has to know of it, and what the jobs recorded put together again.

DVC reads and writes the whole file for each stage that it runs: 0.3 s with 80 stages, so that the time of a `dvc repro`
grows with the square of the subjects. A job gets the part of its own subject, and all parts come back in one write.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from dvc.repo import Repo
from ruamel.yaml import YAML

from facefolds_core.files.writing import write_text

LOCK = "dvc.lock"


def parts_of(root: Path, subjects: Iterable[str]) -> dict[str, str]:
    """Subject -> text of a dvc.lock with its stages and those of no subject; "" where nothing is recorded."""
    path = root / LOCK
    whole = (_yaml().load(path.read_text(encoding="utf-8")) if path.is_file() else None) or {}
    stages = whole.get("stages") or {}
    found = {}
    for subject in subjects:
        own = {name: entry for name, entry in stages.items() if "@" not in name or name.endswith(f"@{subject}")}
        found[subject] = _text({**whole, "stages": own}) if own else ""
    return found


def put_together(root: Path, parts: Iterable[str]) -> None:
    """Write the stages of all parts into the project's dvc.lock, in place of what it says of them; others stay.

    It waits for another DVC that holds the project's lock.
    """
    read = [_yaml().load(part) for part in parts if part]
    if not read:
        return
    with Repo(str(root), _wait_for_lock=True).lock:
        path = root / LOCK
        whole = (_yaml().load(path.read_text(encoding="utf-8")) if path.is_file() else None) or dict(read[0], stages={})
        for part in read:
            whole["stages"].update(part["stages"])
        write_text(path, _text(whole))


def _yaml() -> YAML:
    """As DVC writes it."""
    yaml = YAML()
    yaml.default_flow_style = False
    return yaml


def _text(value: Any) -> str:
    stream = io.StringIO()
    _yaml().dump(value, stream)
    return stream.getvalue()
