"""What the commands of the benchmark share: scenes, conditions, and the words of the command line."""

from __future__ import annotations

from pathlib import Path

import torch
import typer

from bench.results import ClockKind, Conditions, Measurement, Results, commit_name, describe, machine_name
from facefolds_core.errors import UserError
from facefolds_core.model.device import pick_device
from facefolds_core.paths import SubjectFolders
from facefolds_core.training.report import device_name

OWN_SUBJECTS = ("actor", "mugsy")


def find_scenes(names: list[str], data: Path) -> dict[str, Path]:
    """Prepared scenes of the subjects; without names those of OWN_SUBJECTS that are there.

    Raises:
        UserError: if a scene is not there.
    """
    chosen = names or [name for name in OWN_SUBJECTS if _has_scene(data, name)] or [OWN_SUBJECTS[0]]
    for name in chosen:
        if not _has_scene(data, name):
            raise UserError(
                f"no prepared scene of {name}",
                file=SubjectFolders(data / name).scene,
                expected="a normalised scene (scene.json and frames.arrow)",
                remedy=f"`dvc repro normalize@{name}` makes it of a subject in params.yaml (docs/subjects.md), or give "
                "other names by --subjects",
            )
    return {name: SubjectFolders(data / name).scene for name in chosen}


def _has_scene(data: Path, name: str) -> bool:
    return (SubjectFolders(data / name).scene / "scene.json").exists()


def words(text: str) -> list[str]:
    """ "a,b" -> ["a", "b"]; "" -> []."""
    return [part for part in text.split(",") if part]


def numbers(text: str, option: str) -> list[float]:
    """ "10,30" -> [10.0, 30.0], rising.

    Raises:
        UserError: if it is not a list of positive numbers.
    """
    try:
        values = sorted({float(part) for part in text.split(",")})
    except ValueError:
        values = [0.0]
    if values[0] <= 0:
        raise UserError("not a list of seconds", place=option, expected="e.g. 10,30,60", found=text)
    return values


def conditions_now(clock: ClockKind, threads: int, frames: int, device: str) -> Conditions:
    """Of measurements that are made now, told to the user.

    Args:
        threads: 0 is what torch takes.
    """
    conditions = Conditions(
        commit=commit_name(Path(__file__).parent),
        clock=clock,
        threads=threads or torch.get_num_threads(),
        machine=machine_name(device_name(pick_device(device))),
        frames=frames,
    )
    typer.echo(f"bench: clock {clock}, {conditions.threads} threads, {conditions.machine}, {conditions.commit}")
    return conditions


def keep(path: Path, measurement: Measurement) -> None:
    Results(path).add(measurement)
    typer.echo(f"bench: {describe(measurement)}")
