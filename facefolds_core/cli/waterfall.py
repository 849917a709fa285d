"""Measure what each step of the export loses: `facefolds waterfall data/<subject>`; the report shows it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.captures.found_scene import found_scene
from facefolds_core.cli.report import evaluated_subjects
from facefolds_core.config import read_stage, read_train
from facefolds_core.errors import report_user_errors
from facefolds_core.files import atomic_folder, write_json
from facefolds_core.model import load_model
from facefolds_core.model.device import device_of
from facefolds_core.params import EvaluateParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.perceptual import load_st_lpips
from facefolds_core.scoring.terminal import REGION_WORDS, SPLIT_WORDS
from facefolds_core.scoring.waterfall import Step, Waterfall, waterfall


def command(
    subjects: Annotated[
        list[Path] | None, typer.Argument(help="Folders of subjects. Left out: all under --data that have scores.")
    ] = None,
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    frames: Annotated[int, typer.Option(help="Of each camera, evenly spread over those with the subject.", min=1)] = 3,
) -> None:
    """Score every step of the export, from the model to the files that ship: waterfall/waterfall.json."""
    with report_user_errors("waterfall"):
        st_lpips = load_st_lpips()
        for folders in map(SubjectFolders, subjects or evaluated_subjects(data)):
            scene, device = found_scene(folders), device_of(read_train(folders.config))
            model, params = load_model(folders.model, device), read_stage(EvaluateParams, folders.config)
            distance = None if st_lpips is None else st_lpips.to(device)
            found = waterfall(scene, model, folders, frames, distance, params)
            with atomic_folder(folders.waterfall.parent) as temporary:
                write_json(temporary / folders.waterfall.name, {"subject": folders.root.name} | asdict(found))
            typer.echo("\n".join([*lines(folders.root.name, found.steps), measured_on(found)]))


def measured_on(found: Waterfall) -> str:
    """Which pictures, and which pixels of them."""
    cameras, where = SPLIT_WORDS[found.split], REGION_WORDS[found.region]
    return f"pictures: {found.images}, of cameras {cameras}; region: {found.region}, the pixels of {where}"


def lines(subject: str, steps: list[Step]) -> list[str]:
    """A step each, aligned, below what the columns are."""
    width = max(len(subject), len("subject"))
    head = f"{'subject':{width}s} {'step':9s}  PSNR, dB  to model    SSIM  SSIM of high  ST-LPIPS         bytes"
    return [head, *(f"{subject:{width}s} {_cells(step)}" for step in steps)]


def _cells(step: Step) -> str:
    to_model = f"{step.psnr_to_model:8.2f}" if step.psnr_to_model is not None else f"{'-':>8s}"
    st_lpips = f"{step.st_lpips:8.4f}" if step.st_lpips is not None else f"{'-':>8s}"
    figures = f"{step.psnr:8.2f}  {to_model}  {step.ssim:.4f}  {step.ssim_high:12.4f}  {st_lpips}"
    return f"{step.name:9s}  {figures}  {step.mesh_bytes + step.texture_bytes:12d}"
