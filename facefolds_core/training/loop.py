"""The training loop: from a normalised scene to a model folder, interruptible at any moment."""

from __future__ import annotations

import math
import shutil
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from facefolds_core.captures.scene import SPHERE_CENTRE, Scene
from facefolds_core.errors import UserError
from facefolds_core.model.device import pick_device
from facefolds_core.model.manifolds import MlpManifolds
from facefolds_core.model.storage import ModelSpec, build_model
from facefolds_core.params import MlpParams
from facefolds_core.progress import progress
from facefolds_core.training.checkpoints import (
    CHECKPOINT,
    TrainingState,
    fingerprint,
    load_checkpoint,
    save_checkpoint,
)
from facefolds_core.training.log import log_metrics, open_log
from facefolds_core.training.losses import Losses, batch_losses
from facefolds_core.training.rays import RaySampler
from facefolds_core.training.report import Trained, TrainingReport, device_name, make_report, peak_memory
from facefolds_core.training.start import Start, find_start, fit_outline

LOG_POINTS = 500
"""Lines in the log of a whole training, at least; never more than 100 iterations apart."""

DECAY_MANIFOLD, DECAY_TEXTURE = 0.05, 0.20
"""Factors by which the rates fall each `decay_interval` iterations: the paper's."""

LAMBDA_VIEW = 1.0
"""Weight of the mean |view term|^2: the paper's."""

SHAPE: dict[str, Any] = {
    "manifold_layers": 3,
    "latent_dim": 32,
    "level_frequencies": 4,
    "view_frequencies": 4,
    "input_scale": 6.0,
}
"""Of every model that is trained: the paper's, but for `input_scale`, the factor on x - c. Larger values follow a face
more closely."""


def learning_rates(params: MlpParams, iteration: int) -> dict[str, float]:
    """lr_0 decay^(iteration / interval): the paper's decay "of 0.05 and 0.20 per 200 000 iterations" as factors."""
    time_constant = iteration / params.decay_interval
    return {
        "manifold": params.lr_manifold * DECAY_MANIFOLD**time_constant,
        "texture": params.lr_texture * DECAY_TEXTURE**time_constant,
    }


def model_spec(params: MlpParams, start: Start, num_frames: int, fingerprint: str) -> ModelSpec:
    shared = set(ModelSpec.model_fields) & set(MlpParams.model_fields)
    return ModelSpec(
        centre=SPHERE_CENTRE,
        levels=start.levels,
        radius=start.radius,
        num_frames=num_frames,
        fingerprint=fingerprint,
        **SHAPE,
        **params.model_dump(include=shared),
    )


def new_state(params: MlpParams, spec: ModelSpec, device: torch.device) -> TrainingState:
    """Model, optimiser and ray generator before the first step; the same on every device for a seed."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(params.seed)
        model = build_model(spec).to(device)
    named = list(model.named_parameters())
    groups = [
        {"params": [p for n, p in named if n.startswith("manifolds.")], "name": "manifold"},
        {"params": [p for n, p in named if n.startswith("textures.")], "name": "texture"},
    ]
    optimiser = torch.optim.Adam(groups, lr=params.lr_texture)
    return TrainingState(model, optimiser, torch.Generator().manual_seed(params.seed))


def train_step(state: TrainingState, sampler: RaySampler, params: MlpParams) -> Losses:
    """One Adam step.

    Raises:
        UserError: if the loss or a gradient is not finite; the parameters are then still those before the step.
    """
    rates = learning_rates(params, state.iteration)
    for group in state.optimiser.param_groups:
        group["lr"] = rates[group["name"]]
    losses = batch_losses(state.model, sampler.draw(params.rays, state.generator), LAMBDA_VIEW, params.lambda_reg)
    state.optimiser.zero_grad()
    losses.total.backward()
    # A parameter that this batch did not reach takes a step with gradient zero, so that Adam's state is always whole.
    for parameter in state.model.parameters():
        if parameter.grad is None:
            parameter.grad = torch.zeros_like(parameter)
    norm = torch.nn.utils.get_total_norm([p.grad for p in state.model.parameters() if p.grad is not None])
    if not math.isfinite(float(losses.total.detach() + norm)):
        raise UserError(
            "training diverged: the loss or a gradient is not finite",
            place=f"iteration {state.iteration}, learning rates {rates['manifold']:.3g} (manifold), "
            f"{rates['texture']:.3g} (texture)",
            expected="finite numbers",
            found=f"loss {float(losses.total.detach()):.4g}, gradient norm {float(norm):.4g}",
            remedy="lower train.lr_manifold and train.lr_texture in params.yaml (halve them), or change train.seed, "
            "and run `dvc repro` again; nothing of this run was kept as a model",
        )
    state.optimiser.step()
    state.iteration += 1
    return losses


@dataclass(frozen=True)
class TrainingRun:
    """A training under way: what `train_step` asks for, and what its model folder and checkpoint need.

    Attributes:
        state, sampler: see there.
        spec: of the model.
        fingerprint: the run's `fingerprint`.
        checkpoints: folder of this run's checkpoint.
    """

    state: TrainingState
    sampler: RaySampler
    spec: ModelSpec
    fingerprint: str
    checkpoints: Path


def begin(scene: Scene, params: MlpParams, checkpoints: Path) -> TrainingRun:
    """A training before its first step, or at its last checkpoint if there is one.

    Args:
        checkpoints: folder of checkpoints; this run's lies in a subfolder named by its fingerprint.

    Raises:
        UserError: if the checkpoint found is damaged.
    """
    device = pick_device(params.device)
    start = find_start(scene, params)
    own = fingerprint(params, scene)
    spec = model_spec(params, start, scene.num_frames, own)
    state = new_state(params, spec, device)
    run = TrainingRun(state, RaySampler(scene, state.model.centre, spec.radius, device), spec, own, checkpoints / own)
    if (run.checkpoints / CHECKPOINT).exists():
        load_checkpoint(state, own, run.checkpoints)
        print(f"train: continuing from iteration {state.iteration} ({run.checkpoints / CHECKPOINT})")
    else:
        _move_to_mesh(state, params, start)
    return run


class _Progress:
    """Log (dvclive) and progress bar: averages over the iterations since the last line."""

    def __init__(self, params: MlpParams, folder: Path, iteration: int, psnr: float) -> None:
        self.params = params
        self.every = max(1, min(100, params.iterations // LOG_POINTS))
        _trim_log(folder, iteration)
        self.live = open_log(folder, resume=iteration > 0)
        self.bar = progress(total=params.iterations, initial=iteration, unit="it", desc="train")
        self.sums: list[float] = []
        self.count = 0
        self.since = time.perf_counter()
        self.psnr = psnr

    def update(self, losses: Losses, iteration: int) -> None:
        values = [float(value.detach()) for value in vars(losses).values()]
        self.sums = [a + b for a, b in zip(self.sums, values, strict=True)] if self.count else values
        self.count += 1
        self.bar.update()
        if iteration % self.every and iteration < self.params.iterations:
            return
        means = dict(zip(vars(losses), (s / self.count for s in self.sums), strict=True))
        self.psnr = -10 * math.log10(max(means.pop("squared_error"), 1e-10))
        now = time.perf_counter()
        rates = learning_rates(self.params, iteration - 1)
        metrics = {f"loss/{name}": value for name, value in means.items()}
        metrics |= {"psnr": self.psnr, "lr/manifold": rates["manifold"], "lr/texture": rates["texture"]}
        metrics["rays_per_second"] = self.count * self.params.rays / (now - self.since)
        log_metrics(self.live, iteration, metrics)
        self.live.make_summary()
        self.bar.set_postfix_str(f"PSNR {self.psnr:.2f} dB", refresh=False)
        self.count, self.since = 0, now

    def close(self) -> None:
        self.bar.close()
        self.live.end()


def _trim_log(folder: Path, iteration: int) -> None:
    """Drop lines of the log that lie after the checkpoint that training continues from."""
    for path in (folder / "plots" / "metrics").rglob("*.tsv") if iteration else ():
        header, *rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
        column = header.split("\t").index("step")
        path.write_text(header + "".join(r for r in rows if int(r.split("\t")[column]) <= iteration), encoding="utf-8")


def train(scene: Scene, params: MlpParams, model_folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    """Train on `scene`, write the model's folder, whole, and remove the checkpoint.

    A run that was interrupted continues from its last checkpoint, to the same result (bit for bit on a CPU with the
    same number of threads).

    Args:
        checkpoints: folder of checkpoints; this run's lies in a subfolder named by its fingerprint.
        log: folder of dvclive's files.

    Raises:
        UserError: if training diverges (the last checkpoint stays), or the checkpoint found is damaged.
    """
    run = begin(scene, params, checkpoints)
    psnr = _finish(run, params, log)
    state, device = run.state, run.sampler.device
    rays = state.iteration * params.rays
    memory = peak_memory(device)
    report = make_report(state.seconds, state.iteration, device_name(device), memory, params.preset, rays, psnr)
    Trained(state.model, run.spec, report, params).save(model_folder)
    shutil.rmtree(run.checkpoints, ignore_errors=True)
    return report


def _move_to_mesh(state: TrainingState, params: MlpParams, start: Start) -> None:
    manifolds = state.model.manifolds
    if params.manifold_start == "surface" and start.outline is not None and isinstance(manifolds, MlpManifolds):
        began = time.perf_counter()
        error = fit_outline(manifolds, start.outline, state.generator)
        state.seconds += time.perf_counter() - began
        print(f"train: manifolds start at the tracked mesh, mean error {error:.4f} units")


def _finish(run: TrainingRun, params: MlpParams, log: Path) -> float:
    """All remaining iterations; returns the PSNR of the last log interval."""
    state = run.state
    progress = _Progress(params, log, state.iteration, state.psnr)
    saved = last = time.perf_counter()
    try:
        while state.iteration < params.iterations:
            losses = train_step(state, run.sampler, params)
            progress.update(losses, state.iteration)
            now = time.perf_counter()
            state.seconds, last = state.seconds + now - last, now
            if now - saved > params.checkpoint_seconds:
                state.psnr = progress.psnr
                save_checkpoint(state, run.fingerprint, run.checkpoints)
                saved = now
    finally:
        progress.close()
    state.psnr = progress.psnr
    return progress.psnr
