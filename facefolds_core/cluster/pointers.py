"""What parts of a training leave, in DVC's cache or remote; `dvc add` says in a few lines which (NAME.dvc)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from facefolds_core.files import read_json
from facefolds_core.training.segments.names import BASE, PLAN

END = ".dvc"


def take_folder(root: Path, subject: str) -> Path:
    """Where the stage `train` takes up base and segments."""
    return root / "data" / subject / "checkpoints" / "take"


def put_pointers(place: Path, root: Path, files: Sequence[tuple[str, str]]) -> list[str]:
    """Write them; their paths, relative to the project, for DVC to bring what they point at."""
    for name, text in files:
        path = place / f"{name}{END}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return [str((place / f"{name}{END}").relative_to(root)) for name, _ in files]


def made_by(place: Path, part: str) -> list[str]:
    """Names of what a part has left."""
    plan = read_json(place / PLAN)
    if part == BASE:
        return [PLAN, *([plan["folder"]] if plan["segments"] else [])]
    return [plan["segments"][int(part)]["file"]]


def keep(place: Path, root: Path, names: Sequence[str], push: bool) -> list[list[str]]:
    """DVC's commands that put these into its cache, and into the default remote."""
    paths = [str((place / name).relative_to(root)) for name in names]
    add = ["add", *paths]
    return [add, ["push", *(f"{path}{END}" for path in paths)]] if push else [add]


def read_pointers(place: Path, names: Sequence[str]) -> dict[str, str]:
    """Name -> what `dvc add` said of it; those that it failed to add are left out."""
    paths = {name: place / f"{name}{END}" for name in names}
    return {name: path.read_text(encoding="utf-8") for name, path in paths.items() if path.is_file()}
