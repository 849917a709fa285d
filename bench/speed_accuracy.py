"""Speed against accuracy of the trainers: `make bench`.

Trains presets with several numbers of iterations, scores the view-independent model on the held-out cameras, keeps each
measurement in bench/results/speed_accuracy.json, and draws the chart. What is there for this commit is not measured
again. Trainings run in data/bench/<subject>, on the subject's own capture.
"""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Annotated

import torch
import typer

from bench import charts
from bench.results import Clock, Conditions, Measurement, Scores, Store, commit_name, machine_name, mean, now
from bench.run import Project, own_params, score_model
from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_train
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import read_json
from facefolds_core.model.device import device_of, pick_device
from facefolds_core.scoring.panels import METRICS
from facefolds_core.scoring.perceptual import find_perceptual
from facefolds_core.spacing import spread
from facefolds_core.training.report import device_name

RESULTS = Path("bench/results/speed_accuracy.json")
PICTURE = Path("docs/images/speed_accuracy.png")
ITERATIONS = {
    "fast": (183, 460, 1000, 2400, 5000, 18000),
    "quick": (100, 300, 600, 1200, 3000, 9000),
    "paper": (1, 2, 4, 8, 20, 60),
}
"""Of each preset: some 10 s to 15 minutes of training on two cores."""


def score(project: Project, frames: int) -> Scores:
    """The model on `frames` of each held-out camera, evenly spaced.

    Raises:
        UserError: if there is no held-out camera.
    """
    scene = read_scene(project.folders.scene)
    times = {k: float(k) for k in spread(range(scene.num_frames), frames)}
    device = device_of(read_train(project.folders.config))
    found = [v for _, _, v in score_model(project.folders.model, scene, times, find_perceptual(device), device)]
    if not found:
        raise UserError("no held-out camera: there is nothing to score on", file=scene.folder / "scene.json")
    suffix = "_subject" if (masked := [v for v in found if v["psnr_subject"] is not None]) else ""
    values = {name: mean([v[name + suffix] for v in masked or found]) for name in METRICS}
    region = {"region": "subject" if masked else "frame", "images": len(masked or found)}
    return Scores.model_validate(region | values)


@cache
def prepare(project: Project) -> None:
    """Its scene and subject, anew, once for all trainings of this command."""
    project.write(own_params(project.subject, {}))
    project.run("configure", "capture", "normalize", "subject")


def measure(project: Project, blank: Measurement) -> Measurement:
    """One training, timed anew, and scored; a failed one is a result."""
    prepare(project)
    conditions = blank.conditions
    try:
        project.write(own_params(project.subject, {"train": {"preset": blank.preset, "iterations": blank.iterations}}))
        project.run("configure", "train")
        report = read_json(project.folders.model / "training.json")
        processor = report["processor_seconds"] / conditions.threads
        found = {
            "seconds": report["seconds"] if conditions.clock == "wall" else processor,
            "peak_memory_bytes": report["peak_memory_bytes"],
            "scores": score(project, conditions.frames),
        }
    except UserError as error:
        found = {"failure": error.message}
    return blank.model_copy(update=found)


def describe(m: Measurement) -> str:
    """One line for the terminal."""
    cost = f"{m.seconds:.1f} s ({m.iterations} iterations, {m.peak_memory_bytes / 2**30:.2f} GiB)"
    good = m.scores and f"{m.scores.psnr:.2f} dB on the {m.scores.region} after {cost}"
    return f"{m.subject}, {m.preset}: {good or f'failed: {m.failure}'}"


def main(
    subjects: Annotated[str, typer.Option(help="Comma-separated names in params.yaml.")] = "actor",
    presets: Annotated[str, typer.Option(help="Comma-separated.")] = "fast,quick,paper",
    iterations: Annotated[str, typer.Option(help="Comma-separated; by default some 10 s to 15 minutes' worth.")] = "",
    clock: Annotated[Clock, typer.Option(help="`processor`: processor time / --threads, where others work.")] = "wall",
    threads: Annotated[int, typer.Option(help="That share the work; 0 is what torch takes.")] = 0,
    frames: Annotated[int, typer.Option(help="Of each held-out camera that are scored, evenly spaced.")] = 3,
    work: Annotated[Path, typer.Option(help="Folder for the trainings.")] = Path("data/bench"),
    results: Annotated[Path, typer.Option(help="File that measurements are added to.")] = RESULTS,
    force: Annotated[bool, typer.Option("--force", help="Measure again what is there.")] = False,
    draw_only: Annotated[bool, typer.Option("--draw-only", help="Only draw what is there.")] = False,
) -> None:
    """Measure and draw speed against accuracy."""
    with report_user_errors("bench"):
        store, machine = Store(results, "measurements", Measurement), machine_name(device_name(pick_device("auto")))
        count = threads or torch.get_num_threads()
        conditions = Conditions(commit=commit_name(), clock=clock, threads=count, machine=machine, frames=frames)
        for subject in [] if draw_only else subjects.split(","):
            blanks = [
                Measurement(subject=subject, preset=preset, iterations=wanted, conditions=conditions, date=now())
                for preset in presets.split(",")
                for wanted in ([int(n) for n in iterations.split(",")] if iterations else ITERATIONS[preset])
            ]
            for found in store.fill(blanks, partial(measure, Project(work / subject, subject)), force):
                typer.echo(f"bench: {describe(found)}")
        charts.speed(store.read(), PICTURE)
        typer.echo(f"bench: {PICTURE} drawn from {results}")


if __name__ == "__main__":
    typer.run(main)
