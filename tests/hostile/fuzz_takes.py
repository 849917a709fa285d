"""Trainings of a long take that are killed (SIGKILL) at seeded moments and begun again until they end.

Segments that were there before a kill are there after it, and every model that comes out is that of a training without
a break, bit for bit.
"""

from __future__ import annotations

import shutil
import subprocess
import time
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load_file

from bench.run import Project
from facefolds_core.params import merged
from tests.cluster import takes
from tests.hostile.damage import Counts

PARAMS: dict[str, Any] = merged(
    takes.PARAMS,
    {
        "capture": {"frames": 24},
        "train": {"segments": {"key_frames": 4, "frames": 4, "steps": 60, "processes": 2}},
    },
)
"""params.yaml: steps enough that most kills come while segments are fitted."""


def training(project: Project) -> subprocess.Popen[str]:
    """The stage `train`, begun."""
    with (project.root / "train.log").open("a") as log:
        return project.begin("train", stdout=log, stderr=log)


def segments(project: Project) -> set[str]:
    """Names of the finished ones."""
    return {path.name for path in (project.folders.checkpoints / "take").glob("segment-*.safetensors")}


def model(project: Project) -> dict[str, str]:
    """Digests of the model's numbers, file by file; the order in which a file holds them may differ."""
    files = sorted(project.folders.model.rglob("*.safetensors"))
    numbers = {
        path.name: sorted((name, values.tobytes()) for name, values in load_file(path).items()) for path in files
    }
    return {name: sha256(repr(found).encode()).hexdigest() for name, found in numbers.items()}


def forget(project: Project) -> None:
    """The model, and what later trainings would take up."""
    for folder in (project.folders.model, project.folders.checkpoints):
        shutil.rmtree(folder, ignore_errors=True)


def run(count: int, seed: int, folder: Path) -> Counts:
    """`count` kills; the training after the last one may end."""
    counts, random, project = Counts(), np.random.default_rng(seed), Project(folder, "take")
    project.write(PARAMS)
    project.run("configure", "capture", "normalize", "subject")
    start = time.perf_counter()
    project.run("train")
    seconds, expected = time.perf_counter() - start, model(project)
    assert expected and segments(project)
    forget(project)
    while True:
        before, running = segments(project), training(project)
        last, what = counts.tried == count, f"takes, seed {seed}, kill {counts.tried}"
        try:
            code = running.wait(None if last else random.uniform(0, seconds))
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
            counts.tried += 1
            if lost := before - segments(project):
                counts.harmed.append(f"{what}: {len(lost)} finished segments lost")
            continue
        if code:
            counts.crashed.append(f"{what}: {(project.root / 'train.log').read_text()[-300:]}")
        elif model(project) == expected:
            counts.accepted += 1
        else:
            counts.kept_wrong.append(f"{what}: another model than that of no kill")
        forget(project)
        if last or code:
            return counts
