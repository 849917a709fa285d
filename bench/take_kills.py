"""Trainings of a long take that are killed at random moments: what is lost, and whether the result is the same.

python -m bench.take_kills FOLDER [--kills 20]

A tiny take is trained in segments without a break; then it is trained anew, killed (SIGKILL) at random moments and
begun again, until it ends, as often as it takes for all kills. Segments that were there before a kill must be there
after it, and every model that comes out must be that of the training without a break, bit for bit.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from bench.results import ROOT
from bench.run import Project
from bench.takes import watched
from facefolds_core.errors import UserError, report_user_errors

PARAMS: dict[str, Any] = {
    "capture": {"cameras": 8, "frames": 24, "height": 48, "width": 32},
    "normalize": {},
    "train": {
        "preset": "fast",
        "layers": 3,
        "iterations": 60,
        "volume": {"levels": [{"resolution": 24, "iterations": 60}, {"resolution": 48, "iterations": 60}]},
        "textures": {"steps_per_frame": 8},
        "segments": {"joint_frames": 0, "key_frames": 4, "frames": 4, "steps": 60},
    },
    "sample": {},
    "reconstruct": {},
    "decimate": {},
    "texture": {},
    "bake": {},
    "compress": {},
    "evaluate": {},
}
"""params.yaml but for the subject: steps enough that most kills come while segments are fitted."""


def training(project: Project) -> subprocess.Popen[bytes]:
    """The stage `train`, begun."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "stages.train", "--subject", project.subject]
    with (project.root / "train.log").open("ab") as log:
        return subprocess.Popen(command, cwd=project.root, env=environment, stdout=log, stderr=log)


def segments(project: Project) -> set[str]:
    """Names of the finished ones."""
    return {path.name for path in (project.folders.checkpoints / "take").glob("segment-*.safetensors")}


def digest(project: Project) -> str:
    """Of the model's numbers."""
    files = sorted(project.folders.model.rglob("*.safetensors"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]


def forget(project: Project) -> None:
    """The model, and what later trainings would take up."""
    for folder in (project.folders.model, project.folders.checkpoints):
        shutil.rmtree(folder, ignore_errors=True)


def whole(project: Project) -> tuple[str, float]:
    """Digest and seconds of a training without a break.

    Raises:
        UserError: if it fails.
    """
    start = time.perf_counter()
    if training(project).wait():
        raise UserError("train failed", file=project.root / "train.log", remedy="read the log")
    return digest(project), time.perf_counter() - start


@dataclass
class Found:
    """Attributes:
    kills: made so far; of them `early` came before the base was whole.
    lost: finished segments that a kill took away.
    digests: of the models of all trainings that ended.
    """

    kills: int = 0
    early: int = 0
    lost: int = 0
    digests: list[str] = field(default_factory=list)


def killed(project: Project, seconds: float, moments: random.Random, kills: int) -> Found:
    """Train again and again, and kill each training at a moment of `seconds`; the last one may end."""
    found = Found()
    while True:
        before, running = segments(project), training(project)
        last = found.kills == kills
        try:
            code = running.wait(None if last else moments.uniform(0, seconds))
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
            found.kills += 1
            found.early += not any((project.folders.checkpoints / "take").glob("base-*"))
            found.lost += len(before - segments(project))
            continue
        if code:
            raise UserError("train failed", file=project.root / "train.log", remedy="read the log")
        found.digests.append(digest(project))
        forget(project)
        if last:
            return found


def main(
    folder: Annotated[Path, typer.Argument(help="Where the take is made.")],
    kills: Annotated[int, typer.Option(help="How many.")] = 20,
    seed: Annotated[int, typer.Option(help="Of their moments.")] = 0,
) -> None:
    """Kill trainings of a long take."""
    with report_user_errors("take_kills"):
        project = Project(folder, "take")
        subject = {"source": "actor", "path": "facefolds_core/captures/actor", "holdout": {"every": 4}}
        project.write({"subjects": {"take": subject}, **PARAMS})
        for stage in ("configure", "capture", "normalize"):
            watched(project, stage)
        forget(project)
        expected, seconds = whole(project)
        forget(project)
        found = killed(project, seconds, random.Random(seed), kills)
        same = sum(one == expected for one in found.digests)
        typer.echo(
            f"{found.kills} kills within {seconds:.0f} s, {found.early} of them before the base was whole: "
            f"{found.lost} finished segments lost; {same} of the {len(found.digests)} models that came out are, "
            "bit for bit, that of no kill"
        )
        if found.lost or same < len(found.digests):
            raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
