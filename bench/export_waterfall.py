"""What each step of the export loses: a chart and a table for subjects that were exported with `dvc repro`.

python bench/export_waterfall.py --subjects actor

writes data/<subject>/waterfall/waterfall.{json,csv,png}; with --chart one chart of all subjects (PNG), with --plot
their steps for `dvc plots show` (JSON).
"""

from __future__ import annotations

import csv
from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated

import matplotlib as mpl
import typer

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from facefolds_core.captures.scene import read_scene
from facefolds_core.config import read_train
from facefolds_core.errors import report_user_errors
from facefolds_core.files import atomic_file, atomic_folder, write_json
from facefolds_core.model import load_model
from facefolds_core.packaging.views import spread
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.waterfall import Step, waterfall
from facefolds_core.training.report import pick_device


def draw(path: Path, found: dict[str, list[Step]]) -> None:
    """One row of bars a subject."""
    figure, rows = plt.subplots(len(found), figsize=(9, 4.2 * len(found)), layout="constrained", squeeze=False)
    for axes, (subject, steps) in zip(rows[:, 0], found.items(), strict=True):
        draw_steps(axes, subject, steps)
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=120, metadata={"Software": None})
    plt.close(figure)


def draw_steps(axes: Axes, subject: str, steps: list[Step]) -> None:
    """Bars of the PSNR against the photos, with what a step gained or lost, and the bytes."""
    values = [step.psnr for step in steps]
    axes.bar([step.name for step in steps], values, color=["#4c72b0", *["#9aa7bd"] * (len(steps) - 2), "#55a868"])
    for i, step in enumerate(steps):
        change = "" if i == 0 else f"\n{step.psnr - steps[i - 1].psnr:+.2f}"
        size = step.mesh_bytes + step.texture_bytes
        axes.annotate(f"{step.psnr:.2f}{change}", (i, step.psnr), ha="center", va="bottom")
        axes.annotate("" if size == 0 else f"{size / 1e6:.2f} MB", (i, min(values) - 0.9), ha="center", color="white")
    axes.set(ylim=(min(values) - 1, max(values) + 0.8), ylabel="PSNR on held-out cameras, dB", title=subject)
    axes.spines[["top", "right"]].set_visible(False)


def main(
    subjects: Annotated[list[str], typer.Option(help="Names of subjects in params.yaml.")],
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    frames: Annotated[int, typer.Option(help="Frames that are rendered, evenly spread.")] = 3,
    chart: Annotated[Path | None, typer.Option(help="Write a chart of all subjects there (PNG).")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write all steps there, for `dvc plots show` (JSON).")] = None,
) -> None:
    """Score every step of the export on the held-out cameras."""
    found: dict[str, list[Step]] = {}
    with report_user_errors("export_waterfall"):
        for subject in subjects:
            folders = SubjectFolders(data / subject)
            scene = read_scene(folders.scene)
            model = load_model(folders.model, pick_device(read_train(folders.config).device))
            steps = found[subject] = waterfall(scene, model, folders, spread(scene.num_frames, frames))
            with atomic_folder(folders.root / "waterfall") as temporary:
                write_json(temporary / "waterfall.json", {"subject": subject, "steps": [asdict(s) for s in steps]})
                with (temporary / "waterfall.csv").open("w", newline="") as file:
                    rows = csv.writer(file)
                    rows.writerow(["step", *(field.name for field in fields(Step)[1:])])
                    rows.writerows(list(asdict(step).values()) for step in steps)
                draw(temporary / "waterfall.png", {subject: steps})
            for step in steps:
                size = step.mesh_bytes + step.texture_bytes
                typer.echo(f"{subject} {step.name:10s} {step.psnr:6.2f} dB {size:12d} bytes")
        if chart:
            draw(chart, found)
        if plot:
            write_json(plot, [{"subject": name} | asdict(step) for name, steps in found.items() for step in steps])


if __name__ == "__main__":
    typer.run(main)
