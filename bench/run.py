"""How a cell is run where DVC would not do: a folder with a params.yaml of its own, and the real stages' commands."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import torch
import yaml

from bench.results import ROOT, Means
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_text
from facefolds_core.model import load_model
from facefolds_core.params import merged
from facefolds_core.scoring.images import score_images
from facefolds_core.scoring.metrics import shown
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.scoring.truths import Truths
from facefolds_core.system.processes import own_environment

Sections = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Project:
    """A folder with a params.yaml of one subject, and the data that stages make of it."""

    root: Path
    subject: str

    @property
    def folders(self) -> SubjectFolders:
        return SubjectFolders(self.root / "data" / self.subject)

    def write(self, params: Mapping[str, Any]) -> None:
        """params.yaml."""
        self.root.mkdir(parents=True, exist_ok=True)
        write_text(self.root / "params.yaml", yaml.safe_dump(dict(params), sort_keys=False))

    def begin(self, stage: str, stdout: int | IO[str], stderr: int | IO[str]) -> subprocess.Popen[str]:
        """A stage's command with this checkout's code."""
        environment = own_environment(PYTHONPATH=str(ROOT))
        command = [sys.executable, "-m", f"stages.{stage}", "--subject", self.subject]
        return subprocess.Popen(command, cwd=self.root, env=environment, stdout=stdout, stderr=stderr, text=True)

    def run(self, *stages: str) -> None:
        """The stages, one after the other.

        Raises:
            UserError: with what a stage said last, if it failed.
        """
        for stage in stages:
            with self.begin(stage, subprocess.PIPE, subprocess.PIPE) as running:
                said = [line for line in "\n".join(running.communicate()).splitlines() if line.strip()]
            if running.returncode:
                errors = " ".join([line for line in said if line.startswith(f"{stage}: ")] or said[-3:])[:300]
                words = errors or f"ended with {running.returncode}"
                raise UserError(words, place=f"{stage} of {self.subject}", file=self.root)


def own_params(subject: str, changes: Sections, path: Path = ROOT / "params.yaml") -> dict[str, Any]:
    """The project's params.yaml with this subject alone, sections of its own changed; its capture by an absolute path.

    Raises:
        UserError: if there is no such subject.
    """
    params: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    if subject not in params["subjects"]:
        known = ", ".join(params["subjects"])
        raise UserError("no such subject", file=path, place="subjects", found=subject, expected=known)
    entry = merged(params["subjects"][subject], changes)
    if entry.get("source") != "actor":
        entry["path"] = str((path.parent / entry["path"]).resolve())
    return {**params, "subjects": {subject: entry}}


def chosen(given: str, known: Sequence[str], option: str) -> list[str]:
    """Names between semicolons; all, if there are none.

    Raises:
        UserError: if one is not known; names the option.
    """
    names = [name.strip() for name in given.split(";") if name.strip()] or list(known)
    if unknown := set(names) - set(known):
        raise UserError("no such name", place=option, found="; ".join(sorted(unknown)), expected="; ".join(known))
    return names


def score_model(
    folder: Path, scene: Scene, times: Mapping[int, float], perceptual: Perceptual, device: torch.device
) -> Iterator[tuple[str, int, Means]]:
    """What of the model ships (its reflection, no view branch), on the cameras for validation, else the held-out ones.

    Args:
        folder: of the model.
        times: frame of the scene -> time of the model, in its frames.

    Yields:
        camera, frame, values by METRICS and SUBJECT_METRICS.
    """
    model = load_model(folder, device)
    truths, poses = Truths(scene), scene.poses
    variant = 1 if model.reflection_maps() is None else 0
    for index in scene.indices(scene.choice_split):
        view = None
        for k, time in times.items():
            if (index, k) in truths:
                turn = None if poses is None else poses.at(k)
                view = ModelView(model, scene.camera_in_head(index, k), turn) if view is None or poses else view
                truth, picture = truths.at(index, k), shown(view.render(time)[variant])
                values = score_images({"": picture}, truth.picture, truth.mask, perceptual)[""]
                yield scene.cameras[index].name, k, values
