"""One cell of a sweep: the stages from the first that it changes, in folders of their own, and the scores of its asset.

The stages' own functions run on folders that link to what came before. A stage's folder is named after a digest of its
configuration, of the code that it imports, and of the stage before it; so a stage runs once for all
cells that share it, and again when its code changes. What lies before the first changed stage is the subject's own, as
`dvc repro` left it.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.config import read_stage, read_train
from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_json
from facefolds_core.model.device import pick_device
from facefolds_core.params import EvaluateParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering import AssetCaster, composite
from facefolds_core.reporting.facts import STAGE_OUTPUTS
from facefolds_core.scoring.evaluation import ImageScore, frame_rate_factor, score_images, shipped
from facefolds_core.scoring.metrics import shown
from facefolds_core.scoring.perceptual import Perceptual, find_perceptual
from facefolds_core.scoring.report import asset_cost, averages
from facefolds_core.source_code import digests_of_stages
from stages.bake import bake
from stages.compress import compress
from stages.decimate import decimate
from stages.reconstruct import reconstruct
from stages.sample import sample
from stages.texture import texture
from stages.train import train_stage

RUN: dict[str, Callable[[SubjectFolders], str]] = {
    "train": train_stage,
    "sample": sample,
    "reconstruct": reconstruct,
    "decimate": decimate,
    "texture": texture,
    "bake": bake,
    "compress": compress,
}
MADE = {stage: STAGE_OUTPUTS[stage] for stage in RUN}
"""What each stage leaves in a subject's folder."""

SIZES = (
    "vertices",
    "triangles",
    "mesh_bytes",
    "texture_bytes",
    "video_bits_per_second",
    "view_effects_bytes",
    "gpu_bytes",
)
"""Keys of `cost` in metrics.json that are about the asset."""


@dataclass(frozen=True)
class Cell:
    """What is to be run.

    Attributes:
        subject: folder of a subject on which `dvc repro` ran, or at least all stages before `first`.
        work: folder for the stages' folders.
        overrides: stage -> keys that differ from the subject's configuration.
        first: the first stage that runs; those before it must have no overrides.
        project: folder of the code.
    """

    subject: Path
    work: Path
    overrides: Mapping[str, Mapping[str, Any]]
    first: str
    project: Path

    def stages(self) -> list[str]:
        names = list(RUN)
        return names[names.index(self.first) :]

    def section(self, stage: str) -> dict[str, Any]:
        """The stage's section for this cell, not yet checked.

        Raises:
            UserError: if `configure` never ran.
        """
        path = SubjectFolders(self.subject).config / f"{stage}.json"
        own = read_json(path, remedy=f"run `dvc repro evaluate@{self.subject.name}` first")
        return {**own, **self.overrides.get(stage, {})}


def plan(cell: Cell) -> dict[str, str]:
    """Digest of each stage that the cell runs, by name; that of `evaluate` stands for the whole cell.

    Raises:
        UserError: if something is missing of what the cell starts from.
    """
    code = digests_of_stages(cell.project, [*RUN, "evaluate"])
    digest, found = _digest_of_start(cell), {}
    for stage in [*cell.stages(), "evaluate"]:
        parts = [digest, stage, cell.section(stage), code[stage]]
        digest = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]
        found[stage] = digest
    return found


def _digest_of_start(cell: Cell) -> str:
    """Of the scene and of all that the stages before the first one made."""
    names = list(RUN)
    used = [
        "scene",
        *(name for stage in names[: names.index(cell.first)] for name in MADE[stage] if name != "training"),
    ]
    for name in used:
        if not (cell.subject / name).exists():
            remedy = f"run `dvc repro evaluate@{cell.subject.name}` first"
            raise UserError("the sweep's start is missing", file=cell.subject / name, remedy=remedy)
    return _digest_of_files(cell.subject, used)


def _digest_of_files(root: Path, names: list[str]) -> str:
    digest = hashlib.sha256()
    for name in sorted(names):
        paths = sorted((root / name).rglob("*")) if (root / name).is_dir() else [root / name]
        for path in paths:
            if path.is_file() and "__pycache__" not in path.parts:
                with path.open("rb") as file:
                    content = hashlib.file_digest(file, "sha256").digest()
                digest.update(path.relative_to(root).as_posix().encode() + content)
    return digest.hexdigest()


def run_stages(cell: Cell, say: Callable[[str], None]) -> tuple[SubjectFolders, dict[str, float]]:
    """Run what is missing.

    Args:
        say: is told what each stage says.

    Returns:
        the folder of the last stage, and processor seconds of each stage, in this run or in the one that left its
        folder.
    """
    before, seconds = cell.subject, {}
    for stage, digest in plan(cell).items():
        if stage not in RUN:
            continue
        folders = SubjectFolders(cell.work / f"{stage}-{digest}")
        done = folders.timing(stage)
        if not done.exists():
            _prepare(folders, before, stage, cell)
            start = time.process_time()
            say(f"{stage}: {RUN[stage](folders)}")
            write_json(done, {"stage": stage, "processor_seconds": round(time.process_time() - start, 3)})
        seconds[stage] = float(read_json(done)["processor_seconds"])
        before = folders.root
    return SubjectFolders(before), seconds


def _prepare(folders: SubjectFolders, before: Path, stage: str, cell: Cell) -> None:
    """An empty folder for a stage: links to all that stands before it, and the configuration."""
    shutil.rmtree(folders.root, ignore_errors=True)
    folders.root.mkdir(parents=True)
    names = list(RUN)
    for name in ("scene", *(name for earlier in names[: names.index(stage)] for name in MADE[earlier])):
        if (before / name).exists():
            (folders.root / name).symlink_to((before / name).resolve())
    for name in [*RUN, "evaluate"]:
        write_json(folders.config / f"{name}.json", cell.section(name))


def own_metrics(cell: Cell) -> tuple[dict[str, float | None], dict[str, int]] | None:
    """Scores and sizes of the subject's asset, if the cell is its configuration; coarser levels make no difference."""
    folders = SubjectFolders(cell.subject)
    values = [(stage, key, value) for stage, keys in cell.overrides.items() for key, value in keys.items()]
    for stage, key, value in values:
        if (stage, key) != ("compress", "levels") and read_json(folders.config / f"{stage}.json").get(key) != value:
            return None
    if not folders.metrics.exists():
        return None
    metrics = read_json(folders.metrics)
    return metrics["asset"], {name: value for name, value in metrics["cost"].items() if name in SIZES}


def measure(folders: SubjectFolders) -> tuple[dict[str, float | None], dict[str, int]]:
    """Scores of the asset on the held-out cameras, as `evaluate` has them, and its sizes."""
    params = read_stage(EvaluateParams, folders.config)
    perceptual = find_perceptual(pick_device(read_train(folders.config).device))
    asset = read_asset(folders.asset)
    scores = asset_scores(read_scene(folders.scene), asset, params.background, perceptual)
    return averages(scores, "asset"), asset_cost(asset.manifest)


def asset_scores(
    scene: Scene, asset: Asset, background: tuple[float, float, float], perceptual: Perceptual
) -> list[ImageScore]:
    """`evaluate`'s variant `asset` alone: without the model's pictures it takes a third of the time."""
    truths, masks, caster = scene.open_frames(), scene.open_masks(), AssetCaster(asset)
    step = frame_rate_factor(scene, asset)
    cameras = scene.indices("holdout")
    if not cameras:
        raise UserError("no held-out camera: there is nothing to score on", file=scene.folder / "scene.json")
    hits = {index: caster.cast(scene.cameras[index]) for index in cameras}
    found = []
    for k, textures in shipped(asset, list(range(scene.num_frames)), step):
        for index in cameras:
            if (index, k) not in truths:
                continue
            mask = masks.image(index, k)[..., 0] / 255.0 if masks is not None and (index, k) in masks else None
            picture = shown(composite(hits[index], textures, background)[0])
            values = score_images({"asset": picture}, truths.image(index, k) / 255.0, mask, perceptual)["asset"]
            found.append(ImageScore(scene.cameras[index].name, scene.frame_ids[k], "asset", values))
    return found
