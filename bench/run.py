"""How a cell is run: a project folder of its own, its parameters in params.yaml, and the real stages.

`run` calls the stages' commands. `repro` asks DVC, in a copy of the project's code that shares its cache: a stage whose
code, configuration and inputs were seen before, in the project or in another cell, is not run again.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import yaml

from bench.results import ROOT, Means
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_text
from facefolds_core.model import load_model
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.evaluation import score_images
from facefolds_core.scoring.metrics import shown
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.perceptual import Perceptual

Sections = Mapping[str, Mapping[str, Any]]
STAGES = (
    *("configure", "capture", "normalize", "train", "sample", "reconstruct"),
    *("decimate", "texture", "bake", "compress", "evaluate"),
)
DVC_CONFIG = """[core]
    no_scm = true
    analytics = false
[cache]
    dir = {}
    type = reflink,hardlink,copy
"""


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

    def run(self, *stages: str) -> None:
        """The stages' commands with this checkout's code.

        Raises:
            UserError: with what a stage said last, if it failed.
        """
        for stage in stages:
            self._call([sys.executable, "-m", f"stages.{stage}", "--subject", self.subject], stage)

    def repro(self, stage: str, force: bool = False) -> None:
        """All that a stage needs, and itself.

        Args:
            force: run it (not what it needs) though nothing has changed.

        Raises:
            UserError: with what was said last, if something failed.
        """
        for name in ("stages", "facefolds_core"):
            shutil.rmtree(self.root / name, ignore_errors=True)
            shutil.copytree(ROOT / name, self.root / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("dvc.yaml", ".dvcignore"):
            shutil.copyfile(ROOT / name, self.root / name)
        write_text(self.root / ".dvc" / "config", DVC_CONFIG.format(ROOT / ".dvc" / "cache"))
        target = f"{stage}@{self.subject}"
        self._call([sys.executable, "-m", "dvc", "repro", "--quiet", target], stage)
        if force:
            options = ["--quiet", "--force", "--single-item", "--no-run-cache"]
            self._call([sys.executable, "-m", "dvc", "repro", *options, target], stage)

    def _call(self, command: list[str], stage: str) -> None:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": path}
        done = subprocess.run(command, cwd=self.root, env=environment, capture_output=True, text=True)
        if done.returncode:
            said = [line for line in f"{done.stdout}\n{done.stderr}".splitlines() if line.strip()]
            errors = (
                [line for line in said if line.startswith(f"{stage}: ")]
                or said[-3:]
                or [f"ended with {done.returncode}"]
            )
            raise UserError(" ".join(errors)[:300], place=f"{stage} of {self.subject}", file=self.root)


def merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Mappings within mappings are merged, all else is replaced."""
    found = dict(base)
    for key, value in changes.items():
        both = isinstance(value, Mapping) and isinstance(found.get(key), Mapping)
        found[key] = merged(found[key], value) if both else value
    return found


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


def training_of(folders: SubjectFolders) -> dict[str, Any]:
    """training.json, and under "restarts" how often a level diverged and was begun again."""
    fit = folders.model / "fit.json"
    events = read_json(fit)["events"] if fit.exists() else []
    restarts = sum("diverged" in event for event in events)
    return {**read_json(folders.model / "training.json"), "restarts": restarts}


def score_model(
    folder: Path, scene: Scene, times: Mapping[int, float], perceptual: Perceptual, device: torch.device
) -> Iterator[tuple[str, int, Means]]:
    """The model without its view branch on the held-out cameras, as `evaluate` scores its variant `diffuse`.

    Args:
        folder: of the model.
        times: frame of the scene -> time of the model, in its frames.

    Yields:
        camera, frame, values by METRICS and SUBJECT_METRICS.
    """
    model = load_model(folder, device)
    truths, masks = scene.open_frames(), scene.open_masks()
    for index in scene.indices("holdout"):
        view = ModelView(model, scene.cameras[index])
        for k, time in times.items():
            if (index, k) in truths:
                mask = masks.image(index, k)[..., 0] / 255.0 if masks is not None and (index, k) in masks else None
                picture = shown(view.render(time)[1])
                values = score_images({"": picture}, truths.image(index, k) / 255.0, mask, perceptual)[""]
                yield scene.cameras[index].name, k, values
