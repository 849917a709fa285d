"""One training step of a perceptron preset, taken apart: seconds and multiply-adds.

docs/research/2026-11-21-performance.md has what it gave.

The parts are called one after the other on the rays of one step. The limit that they are held against is what this
machine's matrix product reaches on large matrices.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, NamedTuple

import torch
import typer
from torch.utils.flop_counter import FlopCounterMode

from bench.results import machine_name
from bench.tables import markdown
from facefolds_core.captures.scene import read_scene
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.geometry.sphere_uv import points_to_uv
from facefolds_core.model.intersection import bracket_crossings
from facefolds_core.params import train_params
from facefolds_core.paths import SubjectFolders
from facefolds_core.training import loop
from facefolds_core.training.losses import batch_losses
from facefolds_core.training.report import device_name

GEMM_SIZE = 2048
SECTIONS = ("draw rays", "search", "refine", "shade", "other forward", "backward", "optimiser")
Clock = Callable[[], float]


class Step(NamedTuple):
    """What a step costs: seconds, and multiply-adds in matrix products, of each of SECTIONS; crossings of all rays."""

    seconds: dict[str, float]
    products: dict[str, float]
    hits: int


def take_apart(run: loop.TrainingRun, params: Any, clock: Clock) -> Step:
    """The same step timed, and counted (which costs time); no parameter moves."""
    found: list[dict[str, float]] = [{}, {}]
    draws, hits = run.state.generator.get_state(), 0
    for values, counted in zip(found, (False, True), strict=True):
        run.state.generator.set_state(draws)
        hits = _walk(run, params, partial(_measured, values, clock, counted))
        whole = values.pop("crossings")
        values["refine"] = whole - values["search"]
        values["other forward"] = values.pop("forward") - whole - values["shade"]
    return Step(found[0], found[1], hits)


def _measured(values: dict[str, float], clock: Clock, counted: bool, name: str, call: Callable[[], Any]) -> Any:
    if counted:
        with FlopCounterMode(display=False) as counter:
            result = call()
        values[name] = counter.get_total_flops() / 2
        return result
    began = clock()
    result = call()
    values[name] = clock() - began
    return result


def _walk(run: loop.TrainingRun, params: Any, measured: Callable[[str, Callable[[], Any]], Any]) -> int:
    """The parts of a step, those within others once by themselves. Returns the number of crossings."""
    state, model = run.state, run.state.model
    field, textures = model.manifolds, model.textures
    rays = measured("draw rays", lambda: run.sampler.draw(params.rays, state.generator))
    lines = rays.origins, rays.directions
    samples = params.search_samples
    found: Any = field
    measured("search", lambda: bracket_crossings(found, found.levels, *lines, field.centre, field.radius, samples))
    crossings = measured("crossings", lambda: field.crossings(*lines))
    ray, layer = crossings.hit.nonzero(as_tuple=True)
    uv, _ = points_to_uv(crossings.points[ray, layer], field.centre)
    measured("shade", lambda: textures.shade(uv, layer, rays.time[ray], rays.directions[ray]))
    losses = measured("forward", lambda: batch_losses(model, rays, params.lambda_view, params.lambda_reg))
    state.optimiser.zero_grad()
    for group in state.optimiser.param_groups:
        group["lr"] = 0.0
    measured("backward", losses.total.backward)
    measured("optimiser", state.optimiser.step)
    return len(ray)


def gemm_peak(device: torch.device, clock: Clock, repeats: int = 3) -> float:
    """Multiply-adds a second of a product of two square float32 matrices of GEMM_SIZE: the best of some."""
    a, b = torch.rand(2, GEMM_SIZE, GEMM_SIZE, device=device)
    best = float("inf")
    for _ in range(repeats):
        began = clock()
        float((a @ b)[0, 0])
        best = min(best, clock() - began)
    return GEMM_SIZE**3 / best


def report(step: Step, rays: int, peak: float) -> str:
    """Markdown: sections against the limit."""
    total, rows = sum(step.seconds.values()), []
    for name in (*SECTIONS, "all"):
        seconds, products = (sum(v.values()) if name == "all" else v[name] for v in (step.seconds, step.products))
        reached = f"{products / seconds / peak:.0%}" if products and seconds else ""
        share = f"{seconds / total:.0%}"
        rows.append([name, f"{seconds / rays * 1e6:.1f}", share, f"{products / rays / 1e6:.2f}", reached])
    head = ["part of a step", "microseconds a ray", "share", "M multiply-adds a ray", "of the machine's peak"]
    return (
        f"{step.hits / rays:.2f} crossings a ray; {rays / total:.0f} rays a second; matrix products of the machine: "
        f"{peak / 1e9:.0f} G multiply-adds a second.\n\n{markdown(head, rows)}"
    )


def main(
    preset: Annotated[str, typer.Option(help="A perceptron preset.")] = "paper",
    subject: Annotated[str, typer.Option(help="With a prepared scene, data/<subject>/scene.")] = "actor",
    rays: Annotated[int, typer.Option(help="In the step; 0 is the preset's. Time is linear in it.")] = 0,
    device: Annotated[str, typer.Option(help="auto, cpu or cuda.")] = "auto",
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
) -> None:
    """Print a profile of one training step as Markdown."""
    with report_user_errors("profile_step"):
        values: dict[str, Any] = {"preset": preset, "device": device, **({"rays": rays} if rays else {})}
        params = train_params(values)
        if params.model != "mlp":
            raise UserError("not a perceptron preset", place="--preset", expected="paper or quick", found=preset)
        scene = read_scene(SubjectFolders(data / subject).scene)
        with TemporaryDirectory() as folder:
            run = loop.begin(scene, params, Path(folder))
        at = run.sampler.device

        def clock() -> float:
            if at.type == "cuda":
                torch.cuda.synchronize(at)
                return time.perf_counter()
            return time.process_time() / torch.get_num_threads()

        loop.train_step(run.state, run.sampler, params)
        step = take_apart(run, params, clock)
        typer.echo(f"{preset} on {subject}, {params.rays} rays; {machine_name(device_name(at))}\n")
        typer.echo(report(step, params.rays, gemm_peak(at, clock)))


if __name__ == "__main__":
    typer.run(main)
