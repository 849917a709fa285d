"""Measure what each step of the export loses: `facefolds waterfall data/<subject>`; the report shows it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.captures.scene import read_scene
from facefolds_core.cli.report import evaluated_subjects
from facefolds_core.config import read_train
from facefolds_core.errors import report_user_errors
from facefolds_core.files import atomic_folder, write_json
from facefolds_core.model import load_model
from facefolds_core.model.device import device_of
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.waterfall import waterfall
from facefolds_core.spacing import spread


def command(
    subjects: Annotated[
        list[Path] | None, typer.Argument(help="Folders of subjects. Left out: all under --data that have scores.")
    ] = None,
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    frames: Annotated[int, typer.Option(help="Frames that are rendered, evenly spread.", min=1)] = 3,
) -> None:
    """Score every step of the export, from the model to the files that ship: waterfall/waterfall.json."""
    with report_user_errors("waterfall"):
        for folders in map(SubjectFolders, subjects or evaluated_subjects(data)):
            scene = read_scene(folders.scene)
            model = load_model(folders.model, device_of(read_train(folders.config)))
            steps = waterfall(scene, model, folders, spread(range(scene.num_frames), frames))
            with atomic_folder(folders.waterfall.parent) as temporary:
                write_json(
                    temporary / folders.waterfall.name,
                    {"subject": folders.root.name, "steps": [asdict(step) for step in steps]},
                )
            for step in steps:
                size = step.mesh_bytes + step.texture_bytes
                typer.echo(f"{folders.root.name} {step.name:10s} {step.psnr:6.2f} dB {size:12d} bytes")
