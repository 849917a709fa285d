"""Speed against accuracy of the trainers: `make bench`.

Trains the presets on prepared scenes (data/<subject>/scene), scores the view-independent model on the held-out cameras
after each of --seconds, keeps every measurement in bench/results/speed_accuracy.json, and draws the chart. What is
already there for this commit is not measured again; an interrupted run goes on from its checkpoint.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from bench.chart import draw, write_plot_data
from bench.common import conditions_now, find_scenes, keep, numbers, words
from bench.processes import in_a_process
from bench.results import ClockKind, Measurement, Results, describe
from bench.runs import Job, explicit_of, measure_on_the_way, measure_whole
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.params import train_params

SECONDS = "10,30,60,120,300,900"
PRESETS = "fast,quick,paper"
RESULTS = Path("bench/results/speed_accuracy.json")
PICTURE = Path("docs/images/speed_accuracy.png")
NEAR = 0.25
"""An explicit run that misses its budget by more than this fraction is run once more with better iterations."""


def next_iterations(budget: float, known: list[tuple[int, float]], start: int) -> int:
    """Iterations that take about `budget` seconds.

    Args:
        known: (iterations, seconds) of runs so far: the line through the last one and, of the others, the one nearest
            to the budget; without such a line in proportion to the last one.
        start: if there is none.
    """
    if not known:
        return start
    n, t = known[-1]
    rate = t / n
    others = [run for run in known if (run[0] - n) * (run[1] - t) > 0]
    if others:
        m, s = min(others, key=lambda run: abs(run[1] - budget))
        rate = (s - t) / (m - n)
    return max(1, round(n + (budget - t) / rate))


def measure_explicit(job: Job, budgets: list[float], results: Results) -> None:
    """Runs of about `budgets` seconds each. If none is known yet, a first one, not kept, warms caches and is timed."""
    like = job.measurement(1.0, 0.0, 0, 0, None)
    known = [(m.iterations, m.seconds) for m in results.read() if m.key() == like.key() and m.scores is not None]
    guess, least = job.params.iterations, explicit_of(job.params).least_iterations
    if not known:
        first = in_a_process(measure_whole, job, budgets[0], ignore)
        guess = next_iterations(budgets[0], [(first.iterations, first.seconds)], guess)
    for budget in budgets:
        for _ in range(2):
            iterations = max(least, next_iterations(budget, known, guess))
            shorter = replace(job, params=job.params.model_copy(update={"iterations": iterations}))
            made = in_a_process(measure_whole, shorter, budget, partial(keep, results.path))
            known = [run for run in known if run[0] != iterations] + [(iterations, made.seconds)]
            better = max(least, next_iterations(budget, known, guess))
            if abs(made.seconds - budget) <= NEAR * budget or better == iterations:
                break


def ignore(measurement: Measurement) -> None:
    typer.echo(f"bench: (warm-up, not kept) {describe(measurement)}")


def measure(job: Job, budgets: list[float], results: Results, force: bool) -> None:
    """Measure what is missing of one preset on one subject."""
    wanted = [b for b in budgets if force or not results.measured(job.measurement(b, 0.0, 0, 0, None))]
    if not wanted:
        typer.echo(f"bench: {job.subject}, {job.params.preset}: nothing to do, all is measured at this commit")
        return
    if force:
        shutil.rmtree(job.scratch, ignore_errors=True)
    if job.params.model == "explicit":
        measure_explicit(job, wanted, results)
    else:
        in_a_process(measure_on_the_way, job, wanted, partial(keep, results.path))


def main(
    subjects: Annotated[str, typer.Option(help="Comma-separated; by default actor, and mugsy where present.")] = "",
    presets: Annotated[str, typer.Option(help="Comma-separated.")] = PRESETS,
    seconds: Annotated[str, typer.Option(help="Comma-separated training times.")] = SECONDS,
    clock: Annotated[
        ClockKind,
        typer.Option(help="`processor`: processor time / --threads, for a machine that is not idle."),
    ] = "wall",
    threads: Annotated[int, typer.Option(help="That share the work; 0 is what torch takes.")] = 0,
    frames: Annotated[int, typer.Option(help="Of each held-out camera that are scored, evenly spaced.")] = 3,
    device: Annotated[str, typer.Option(help="auto, cpu or cuda.")] = "auto",
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    results: Annotated[Path, typer.Option(help="File that measurements are added to.")] = RESULTS,
    picture: Annotated[Path, typer.Option(help="The chart.")] = PICTURE,
    force: Annotated[bool, typer.Option("--force", help="Measure again what is there.")] = False,
    draw_only: Annotated[bool, typer.Option("--draw-only", help="Only draw what is there.")] = False,
) -> None:
    """Measure and draw speed against accuracy."""
    with report_user_errors("bench"):
        budgets = numbers(seconds, "--seconds")
        file = Results(results)
        failures = []
        if not draw_only:
            conditions = conditions_now(clock, threads, frames, device)
            scenes = find_scenes(words(subjects), data)
            for preset in words(presets):
                for subject, scene in scenes.items():
                    params = train_params({"preset": preset, "device": device})
                    scratch = data / subject / "bench" / f"{conditions.commit}-{clock}{conditions.threads}"
                    try:
                        measure(Job(subject, scene, params, "", conditions, scratch), budgets, file, force)
                    except UserError as error:
                        failures.append(f"{subject}, {preset}: {error}")
        measurements = file.read()
        draw(measurements, picture)
        write_plot_data(measurements, results.with_name(f"{results.stem}_plot.json"))
        typer.echo(f"bench: {picture} drawn from {results}")
        if failures:
            raise UserError("not everything could be measured:\n" + "\n".join(failures))


if __name__ == "__main__":
    typer.run(main)
