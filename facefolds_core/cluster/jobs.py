"""Which jobs there are: one a subject, or one a subject and cell of a grid; and their results put together again."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from facefolds_core.cluster.dvc import THEN
from facefolds_core.cluster.job import RUNNING, Job, Outcome
from facefolds_core.cluster.lockfile import parts_of, put_together
from facefolds_core.cluster.project import CODE
from facefolds_core.config.params_file import Params, params_from
from facefolds_core.errors import UserError
from facefolds_core.files.parsing import brief, parse_yaml
from facefolds_core.files.reading import read_text
from facefolds_core.system.processes import own_environment

BUSY = "is busy, it is being blocked by"
"""DVC says so when another DVC in the folder runs a stage."""

LOOK = 5.0
"""Seconds between two tries then."""


def subject_jobs(params: Params, root: Path, subjects: Sequence[str], stage: str) -> list[Job]:
    """A job a subject, as params.yaml has it.

    Raises:
        UserError: if there is no such subject.
    """
    locks = parts_of(root, subjects)
    return [Job(name, name, f"{stage}@{name}", None, links_of(params, root, name), locks[name]) for name in subjects]


def links_of(params: Params, root: Path, subject: str) -> tuple[tuple[str, str], ...]:
    """Its capture and the mattes that it names, where relative paths lead to them and they are no part of the code."""
    own = params.subject(subject)
    paths = [Path(one) for one in (own.path, own.mattes, own.start) if one is not None]
    outside = [path for path in paths if not path.is_absolute() and path.parts[:1] not in [(name,) for name in CODE]]
    return tuple((str(path), str((root / path).resolve())) for path in outside)


def read_grid(path: Path) -> list[dict[str, Any]]:
    """The cells of a sweep's file: a mapping of keys, "section.key", to lists of values; every combination is a cell.

    Raises:
        UserError: if it is none.
    """
    remedy = "write a line a key, `decimate.resolution: [16, 32, 64]` (docs/guide/sweeps.md)"
    grid = parse_yaml(read_text(path, remedy, expected="YAML"), path, remedy)
    wrong = not isinstance(grid, dict) or not grid
    if wrong or not all(isinstance(key, str) and isinstance(values, list) and values for key, values in grid.items()):
        raise UserError(
            "not a sweep", file=path, expected="keys with lists of values", found=brief(grid), remedy=remedy
        )
    return [dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values())]


def sweep_jobs(
    params: Params, root: Path, subjects: Sequence[str], stage: str, cells: Sequence[Mapping[str, Any]]
) -> dict[Job, Mapping[str, Any]]:
    """A job a subject and cell -> the cell's values, which are overrides of the subject in a params.yaml of its own.

    Raises:
        UserError: if a key or value does not fit.
    """
    jobs: dict[Job, Mapping[str, Any]] = {}
    locks = parts_of(root, subjects)
    for subject in subjects:
        links = links_of(params, root, subject)
        for number, cell in enumerate(cells):
            new = with_values(root / "params.yaml", subject, cell)
            jobs[Job(f"{subject}-{number:03d}", subject, f"{stage}@{subject}", new, links, locks[subject])] = cell
    return jobs


def with_values(path: Path, subject: str, cell: Mapping[str, Any]) -> str:
    """The text of a params.yaml with a cell's values as overrides of a subject that it has: JSON, which YAML holds.

    Raises:
        UserError: if a key or value does not fit.
    """
    tree = parse_yaml(read_text(path, "save it as UTF-8", expected="YAML"), path, "mend it")
    tree = json.loads(json.dumps(tree))  # what aliases shared are values of their own then
    for name, value in cell.items():
        *folders, key = name.split(".")
        place = tree["subjects"][subject]
        for folder in folders:
            if not isinstance(place.get(folder), dict):
                place[folder] = {}
            place = place[folder]
        place[key] = value
    try:
        params_from(tree, path)
    except UserError as error:
        where: dict[str, Any] = {name: getattr(error, name) for name in ("place", "expected", "found", "remedy")}
        raise UserError("a cell of the sweep does not fit into params.yaml", **where) from None
    return json.dumps(tree, indent=2, ensure_ascii=False)


def record(root: Path, outcomes: Sequence[Outcome], pull: bool, everybody: bool) -> tuple[list[str], str]:
    """What good jobs made into the project's folder: their parts of dvc.lock, files from the cache; and a `dvc repro`,
    which looks whether all is there, and makes what is not.

    It waits for another DVC that is at work in the folder.

    Args:
        pull: the results came through DVC's default remote.
        everybody: they are of all subjects that there are: then the stage's name alone is the target, since DVC reads
            dvc.lock again for each one.

    Returns:
        stages that ran nevertheless, and an error, or "".
    """
    targets = list(dict.fromkeys(o.job.target.split("@")[0] if everybody else o.job.target for o in outcomes))
    put_together(root, [outcome.lock for outcome in outcomes])
    fetch = ["pull" if pull else "checkout", "--with-deps", "--force", *targets]
    look = ["repro", *(["--pull"] if pull else []), *targets]
    status, said = _dvc(root, ["--wait-for-lock", *fetch, THEN, "--wait-for-lock", *look])
    return RUNNING.findall(said), said.strip()[-2000:] if status else ""


def _dvc(root: Path, command: Sequence[str]) -> tuple[int, str]:
    """Exit status of DVC commands, when no other DVC is in their way any more, and what they said."""
    while True:
        done = subprocess.run(
            [sys.executable, "-m", "facefolds_core.cluster.dvc", *command],
            cwd=root,
            env=own_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        said = done.stdout + done.stderr
        if not done.returncode or BUSY not in said:
            return done.returncode, said
        time.sleep(LOOK)
