"""One training step of a perceptron preset, taken apart: seconds, multiply-adds and operators; for docs/performance.md.

The limit that it is held against is what this machine's matrix product reaches on large matrices.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any
from unittest.mock import patch

import torch
import typer
from torch.profiler import ProfilerActivity, profile
from torch.utils.flop_counter import FlopCounterMode

from bench.common import find_scenes
from bench.results import machine_name
from facefolds_core.captures.scene import read_scene
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.model import intersection, textures
from facefolds_core.params import MlpParams, train_params
from facefolds_core.training import loop
from facefolds_core.training.losses import batch_losses
from facefolds_core.training.report import device_name

SECTIONS = ("draw rays", "search", "refine", "shade", "other forward", "backward", "optimiser")
GEMM_SIZE = 2048
KINDS = {
    "matrix products": "mm addmm bmm baddbmm",
    "activations and their gradients": "silu silu_ silu_backward relu threshold_backward sigmoid sigmoid_backward",
    "sines and cosines": "sin cos",
    "copies, gathering and scattering": "copy_ cat index index_put_ _index_put_impl_ index_select nonzero gather fill_ "
    "embedding_dense_backward",
    "sums": "sum mean cumprod linalg_vector_norm max min",
}
"""Operators by what they do; the others go into a row of their own."""


@dataclass
class Step:
    """What a step costs.

    Attributes:
        seconds, products: of each of SECTIONS: seconds, and multiply-adds in matrix products.
        operators: name -> seconds of its own, by torch.profiler.
        hits: crossings of all rays.
    """

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    products: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    operators: dict[str, float] = field(default_factory=dict)
    hits: int = 0

    @contextmanager
    def section(self, name: str, clock: Callable[[], float], count: bool) -> Iterator[None]:
        """Add what happens inside to a section; either multiply-adds or time, for counting costs time."""
        if count:
            with FlopCounterMode(display=False) as counter:
                yield
            self.products[name] += counter.get_total_flops() / 2
            return
        began = clock()
        yield
        self.seconds[name] += clock() - began


def take_apart(run: loop.TrainingRun, params: Any, clock: Callable[[], float]) -> Step:
    """The same step timed, counted, and seen by torch.profiler; only the last of the three moves the parameters."""
    step = Step()
    generator = run.state.generator
    draws = generator.get_state()
    for count in (False, True):
        generator.set_state(draws)
        _sectioned(run, params, step, clock, count)
    generator.set_state(draws)
    for values in (step.seconds, step.products):
        values["other forward"] -= sum(values[name] for name in ("search", "refine", "shade"))
    with profile(activities=[ProfilerActivity.CPU]) as profiler:
        loop.train_step(run.state, run.sampler, params)
    for event in profiler.key_averages():
        if event.key.startswith("aten::"):
            step.operators[event.key.removeprefix("aten::")] = event.self_cpu_time_total / 1e6
    return step


def _sectioned(run: loop.TrainingRun, params: Any, step: Step, clock: Callable[[], float], count: bool) -> None:
    def timed(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def wrapped(*arguments: Any, **named: Any) -> Any:
            with step.section(name, clock, count):
                result = function(*arguments, **named)
            if name == "search":
                step.hits = len(result.ray)
            return result

        return wrapped

    state = run.state
    with (
        patch.object(intersection, "bracket_crossings", timed("search", intersection.bracket_crossings)),
        patch.object(intersection, "refine", timed("refine", intersection.refine)),
        patch.object(textures.MlpTextures, "shade", _method(timed, textures.MlpTextures.shade)),
    ):
        rays = timed("draw rays", run.sampler.draw)(params.rays, state.generator)
        losses = timed("other forward", batch_losses)(state.model, rays, params.lambda_view, params.lambda_reg)
    state.optimiser.zero_grad()
    for group in state.optimiser.param_groups:
        group["lr"] = 0.0
    timed("backward", losses.total.backward)()
    timed("optimiser", state.optimiser.step)()


def _method(timed: Callable[[str, Callable[..., Any]], Callable[..., Any]], function: Callable[..., Any]) -> Any:
    wrapped = timed("shade", function)
    return lambda self, *arguments: wrapped(self, *arguments)


def gemm_peak(device: torch.device, clock: Callable[[], float], repeats: int = 3) -> float:
    """Multiply-adds a second of a product of two square float32 matrices of GEMM_SIZE: the best of some."""
    a, b = torch.rand(2, GEMM_SIZE, GEMM_SIZE, device=device)
    best = float("inf")
    for _ in range(repeats):
        began = clock()
        float((a @ b)[0, 0])
        best = min(best, clock() - began)
    return GEMM_SIZE**3 / best


def report(step: Step, rays: int, peak: float) -> str:
    """Markdown: sections against the limit, and kinds of operators."""
    total = sum(step.seconds.values())
    lines = [
        f"{step.hits / rays:.2f} crossings a ray; {rays / total:.0f} rays a second; matrix products of the machine: "
        f"{peak / 1e9:.0f} G multiply-adds a second.",
        "",
        "| part of a step | microseconds a ray | share | M multiply-adds a ray | of the machine's peak |",
        "|---|---|---|---|---|",
    ]
    for name in (*SECTIONS, "all"):
        seconds = total if name == "all" else step.seconds[name]
        products = sum(step.products.values()) if name == "all" else step.products[name]
        reached = f"{products / seconds / peak:.0%}" if products and seconds else ""
        lines.append(
            f"| {name} | {seconds / rays * 1e6:.1f} | {seconds / total:.0%} | {products / rays / 1e6:.2f} | {reached} |"
        )
    lines += ["", "| operators | share |", "|---|---|"]
    everything = sum(step.operators.values())
    rest = dict(step.operators)
    shares = {kind: sum(rest.pop(name, 0.0) for name in names.split()) for kind, names in KINDS.items()}
    shares["all others"] = sum(rest.values())
    lines += [f"| {kind} | {seconds / everything:.0%} |" for kind, seconds in shares.items()]
    return "\n".join(lines)


def main(
    preset: Annotated[str, typer.Option(help="A perceptron preset.")] = "paper",
    subject: Annotated[str, typer.Option(help="With a prepared scene, data/<subject>/scene.")] = "actor",
    rays: Annotated[int, typer.Option(help="In the step; 0 is the preset's. Time is linear in it.")] = 0,
    device: Annotated[str, typer.Option(help="auto, cpu or cuda.")] = "auto",
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
) -> None:
    """Print a profile of one training step as Markdown."""
    with report_user_errors("profile_step"):
        params = train_params({"preset": preset, "device": device, **({"rays": rays} if rays else {})})
        if not isinstance(params, MlpParams):
            raise UserError("not a perceptron preset", place="--preset", expected="paper or quick", found=preset)
        scene = read_scene(find_scenes([subject], data)[subject])
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
