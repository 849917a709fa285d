"""Robustness of the trainers: seeds, learning rates, starts that are off.

Each training is a process of its own on the same budget; what is measured is kept in bench/results/robustness.json,
failures included, and printed as tables for bench/RESULTS.md. What is already there for this commit is not run again.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bench.common import conditions_now, find_scenes, keep, words
from bench.processes import in_a_process
from bench.results import ClockKind, Measurement, Results
from bench.runs import Job, measure_on_the_way, measure_whole
from facefolds_core.captures.scene import SPHERE_CENTRE, read_scene, write_scene
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import atomic_folder
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import merged, nested, train_params, value_at

RESULTS = Path("bench/results/robustness.json")

GEOMETRY_RATES: dict[str, tuple[str, ...]] = {
    "paper": ("lr_manifold",),
    "quick": ("lr_manifold",),
    "fast": ("volume.learning_rate",),
}
"""Keys of `train` that are learning rates of the geometry. A preset without any has no such rows."""

OVERRIDES: dict[tuple[str, str], dict[str, Any]] = {}
"""(name of a variant, preset) -> values of `train` that make the variant, in place of a changed scene."""


@dataclass(frozen=True)
class Variant:
    """One way to disturb a training.

    Attributes:
        name: in the records; "" is the preset as it is.
        seed: of the training.
        rate: factor on the learning rates of the geometry.
        radius: factor on the tracked mesh's distance from c: the surfaces start off by it.
        shift: of c against the subject, units.
    """

    name: str
    seed: int = 0
    rate: float = 1.0
    radius: float = 1.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)


BASE = Variant("")
DISTURBED = (
    Variant("geometry's rate x 0.3", rate=0.3),
    Variant("geometry's rate x 3", rate=3.0),
    Variant("start radius - 20 %", radius=0.8),
    Variant("start radius + 20 %", radius=1.2),
    Variant("centre 0.05 towards the face", shift=(0.05, 0.0, 0.0)),
    Variant("centre 0.05 upwards", shift=(0.0, 0.0, 0.05)),
    Variant("centre 0.05 sideways", shift=(0.0, 0.05, 0.0)),
)


def all_variants(seeds: int) -> list[Variant]:
    return [BASE, *(Variant(f"seed {seed}", seed=seed) for seed in range(1, seeds)), *DISTURBED]


def overrides(variant: Variant, preset: str) -> dict[str, Any] | None:
    """Values of `train` that make the variant; None where the preset has nothing that could be disturbed so."""
    if (variant.name, preset) in OVERRIDES:
        return OVERRIDES[variant.name, preset]
    values: dict[str, Any] = {"seed": variant.seed}
    if variant.rate != 1.0:
        keys = GEOMETRY_RATES.get(preset, ())
        if not keys:
            return None
        usual = train_params({"preset": preset})
        for key in keys:
            values = merged(values, nested(key, variant.rate * value_at(usual, key)))
    return values


def disturbed_scene(source: Path, variant: Variant, target: Path) -> None:
    """Write the scene as if c lay elsewhere in it, and with a tracked mesh that lies farther or nearer.

    c is the same point of the world in every scene: the world moves the other way. Images are the source's own.

    Args:
        source, target: folders of normalised scenes.

    Raises:
        UserError: if the radius is to change and there is no tracked mesh.
    """
    scene = read_scene(source)
    shift, centre = np.array(variant.shift), np.array(SPHERE_CENTRE)
    surface = scene.load_surface()
    if surface is None and variant.radius != 1.0:
        raise UserError("no tracked mesh", file=source, remedy="leave the variants of the start radius out")
    cameras = tuple(
        Camera(
            c.name,
            c.K,
            np.concatenate([c.rotation, -(c.rotation @ (c.centre - shift))[:, None]], 1),
            c.width,
            c.height,
        )
        for c in scene.cameras
    )
    with atomic_folder(target) as temporary:
        write_scene(replace(scene, cameras=cameras), temporary)
        for name in ("frames.arrow", "masks.arrow"):
            if (source / name).exists():
                _link(source / name, temporary / name)
        if surface is not None:
            vertices = centre + variant.radius * (surface[0] - shift - centre)
            np.savez(temporary / "surface.npz", vertices=vertices.astype(np.float32), faces=surface[1])


def _link(source: Path, target: Path) -> None:
    """The same file under another name, or a copy where the disk cannot do that."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def measure(job: Job, variant: Variant, budget: float, results: Results, force: bool) -> None:
    """One training of one preset on one subject, unless it is there already."""
    blank = job.measurement(budget, 0.0, 0, 0, None)
    if not force and results.measured(blank):
        return
    shutil.rmtree(job.scratch, ignore_errors=True)
    try:
        moved = (variant.radius, variant.shift) != (BASE.radius, BASE.shift)
        if moved and (variant.name, job.params.preset) not in OVERRIDES:
            disturbed_scene(job.scene, variant, job.scratch / "scene")
            job = replace(job, scene=job.scratch / "scene")
        record = partial(keep, results.path)
        if job.params.model == "explicit":
            in_a_process(measure_whole, job, budget, record)
        else:
            in_a_process(measure_on_the_way, job, [budget], record)
    except UserError as error:
        keep(results.path, blank.model_copy(update={"failure": str(error).splitlines()[0]}))
    finally:
        shutil.rmtree(job.scratch, ignore_errors=True)


def tables(measurements: Sequence[Measurement]) -> str:
    """Markdown for bench/RESULTS.md, one table a subject: the newest of each measurement, on the newest one's clock.

    Raises:
        UserError: if there is none.
    """
    if not measurements:
        raise UserError("nothing measured yet", remedy="run `python -m bench.robustness`")
    by_date = sorted(measurements, key=lambda m: m.date)
    last = by_date[-1].conditions
    kept = {(m.subject, m.preset, m.variant): m for m in by_date if m.conditions.clock == last.clock}
    commits = ", ".join(sorted({m.conditions.commit for m in kept.values()}))
    unit = "wall clock" if last.clock == "wall" else f"processor time / {last.threads}"
    parts = [
        f"{by_date[-1].date[:10]}, {last.machine}, commits {commits}; seconds of {unit}. PSNR of the view-independent "
        f"model on held-out cameras, {last.frames} frames each, and in brackets what it is against the preset as it is."
    ]
    parts += [
        _table(subject, [m for m in kept.values() if m.subject == subject])
        for subject in sorted({m.subject for m in kept.values()})
    ]
    return "\n\n".join(parts)


def _table(subject: str, measurements: list[Measurement]) -> str:
    presets = sorted({m.preset for m in measurements})
    lines = [_row([f"`{subject}`", *(f"`{preset}`" for preset in presets)]), "|---" * (len(presets) + 1) + "|"]
    rows: list[tuple[str, Callable[[list[Measurement]], str]]] = [
        ("as it is: dB, training time", _base),
        ("seeds: mean, spread (largest - smallest), failures", _seeds),
        *((variant.name, partial(_against_base, name=variant.name)) for variant in DISTURBED),
        ("peak memory of any of these", _memory),
    ]
    for name, cell in rows:
        lines.append(_row([name, *(cell([m for m in measurements if m.preset == preset]) for preset in presets)]))
    return "\n".join(lines)


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _psnr(measurements: list[Measurement], name: str) -> float | None:
    found = [m.scores.psnr for m in measurements if m.variant == name and m.scores is not None]
    return found[-1] if found else None


def _base(measurements: list[Measurement]) -> str:
    for m in measurements:
        if m.variant == BASE.name:
            return f"{m.scores.psnr:.2f} in {m.seconds:.0f} s" if m.scores else f"failed: {m.failure}"
    return "-"


def _seeds(measurements: list[Measurement]) -> str:
    runs = [m for m in measurements if m.variant == BASE.name or m.variant.startswith("seed ")]
    values = [m.scores.psnr for m in runs if m.scores is not None]
    failures = f"{len(runs) - len(values)} of {len(runs)} failed"
    if not values:
        return failures if runs else "-"
    return f"{np.mean(values):.2f}, {max(values) - min(values):.2f}, {failures}"


def _against_base(measurements: list[Measurement], name: str) -> str:
    value, base = _psnr(measurements, name), _psnr(measurements, BASE.name)
    if value is None:
        failed = [m for m in measurements if m.variant == name]
        return f"failed: {failed[-1].failure}" if failed else "-"
    return f"{value:.2f}" if base is None else f"{value:.2f} ({value - base:+.2f})"


def _memory(measurements: list[Measurement]) -> str:
    return f"{max((m.peak_memory_bytes for m in measurements), default=0) / 2**30:.2f} GiB"


def main(
    subjects: Annotated[str, typer.Option(help="Comma-separated; by default actor, and mugsy where present.")] = "",
    presets: Annotated[str, typer.Option(help="Comma-separated.")] = "fast,quick,paper",
    variants: Annotated[str, typer.Option(help="Only those with one of these words in their names.")] = "",
    seeds: Annotated[int, typer.Option(help="How many.")] = 5,
    seconds: Annotated[float, typer.Option(help="Of training for perceptron presets.")] = 120.0,
    iterations: Annotated[int, typer.Option(help="Of explicit presets; 0 is the preset's own.")] = 0,
    clock: Annotated[ClockKind, typer.Option(help="As for bench.speed_accuracy.")] = "wall",
    threads: Annotated[int, typer.Option(help="That share the work; 0 is what torch takes.")] = 0,
    frames: Annotated[int, typer.Option(help="Of each held-out camera that are scored, evenly spaced.")] = 3,
    device: Annotated[str, typer.Option(help="auto, cpu or cuda.")] = "auto",
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    results: Annotated[Path, typer.Option(help="File that measurements are added to.")] = RESULTS,
    force: Annotated[bool, typer.Option("--force", help="Measure again what is there.")] = False,
    table_only: Annotated[bool, typer.Option("--table-only", help="Only print the tables.")] = False,
) -> None:
    """Measure how much disturbed trainings lose, and print tables."""
    with report_user_errors("robustness"):
        file = Results(results)
        if not table_only:
            conditions = conditions_now(clock, threads, frames, device)
            chosen = [v for v in all_variants(seeds) if not variants or any(w in v.name for w in words(variants))]
            chosen += [] if BASE in chosen else [BASE]
            for subject, scene in find_scenes(words(subjects), data).items():
                for variant in chosen:
                    for preset in words(presets):
                        values = overrides(variant, preset)
                        if values is None:
                            typer.echo(f"robustness: {preset} has nothing to disturb by {variant.name!r}: left out")
                            continue
                        params = train_params({"preset": preset, "device": device, **values})
                        if params.model == "explicit" and iterations:
                            params = params.model_copy(update={"iterations": iterations})
                        job = Job(subject, scene, params, variant.name, conditions, data / subject / "bench" / "robust")
                        measure(job, variant, seconds, file, force)
        typer.echo("\n" + tables(file.read()))


if __name__ == "__main__":
    typer.run(main)
