"""Trainings under a clock: one perceptron run that is looked at on its way, or explicit runs of chosen lengths."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.clock import Clock, milestones, time_source
from bench.results import Conditions, Measurement, Scores
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.errors import UserError
from facefolds_core.model import RadianceManifolds, load_model
from facefolds_core.model.device import pick_device
from facefolds_core.packaging.views import spread
from facefolds_core.params import ExplicitParams, MlpParams, TrainParams
from facefolds_core.scoring.evaluation import METRICS, score_images
from facefolds_core.scoring.metrics import shown
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.perceptual import Perceptual, find_perceptual
from facefolds_core.training.checkpoints import save_checkpoint
from facefolds_core.training.explicit.loop import train_explicit
from facefolds_core.training.loop import TrainingRun, begin, train_step
from facefolds_core.training.report import peak_memory

CHECKPOINT_SECONDS = 60.0
"""On the clock of the run, between checkpoints of a perceptron run."""


@dataclass(frozen=True)
class Job:
    """One training.

    Attributes:
        subject: its name.
        scene: folder of the normalised scene.
        params: of the training.
        variant: what differs from the preset, for the records.
        conditions: for the records; its clock is the one that is used.
        scratch: folder for checkpoints; what is there is continued.
    """

    subject: str
    scene: Path
    params: TrainParams
    variant: str
    conditions: Conditions
    scratch: Path

    def measurement(
        self, budget: float, seconds: float, iterations: int, peak: int, scores: Scores | None, failure: str = ""
    ) -> Measurement:
        return Measurement(
            subject=self.subject,
            preset=self.params.preset,
            variant=self.variant,
            budget=budget,
            seconds=round(seconds, 2),
            iterations=iterations,
            peak_memory_bytes=peak,
            scores=scores,
            failure=failure,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            conditions=self.conditions,
        )


Record = Callable[[Measurement], None]


def measure_on_the_way(job: Job, budgets: Sequence[float], record: Record) -> None:
    """One run of a perceptron preset, scored when each of `budgets` has passed; the clock stands still meanwhile.

    The run goes on beyond the preset's iterations if the budgets ask for it: its learning rates then fall on. It
    continues from its checkpoint, unless that is later than the first budget.
    """
    scene, perceptual = read_scene(job.scene), find_perceptual(pick_device(job.params.device))
    clock = Clock(time_source(job.conditions.clock, job.conditions.threads))
    run = _begin(scene, job, clock, min(budgets))
    saved = clock.seconds
    peak = 0

    def save() -> None:
        nonlocal saved
        run.state.seconds = saved = clock.seconds
        with clock.paused():
            save_checkpoint(run.state, run.mark, run.checkpoints)

    def step() -> None:
        # Before the step and not after it: a checkpoint never lies beyond a budget that is not yet recorded.
        if clock.seconds > saved + CHECKPOINT_SECONDS:
            save()
        train_step(run.state, run.sampler, mlp_of(job.params))

    for passed in milestones(clock, budgets, step):
        peak = peak or peak_memory(run.sampler.device)
        scores = score(scene, run.state.model, job.conditions.frames, perceptual)
        for budget in passed:
            record(job.measurement(budget, clock.seconds, run.state.iteration, peak, scores))
        save()


def _begin(scene: Scene, job: Job, clock: Clock, first: float) -> TrainingRun:
    run = begin(scene, mlp_of(job.params), job.scratch)
    if run.state.iteration and run.state.seconds > first:
        shutil.rmtree(run.checkpoints)
        clock.set(0.0)
        run = begin(scene, mlp_of(job.params), job.scratch)
    if run.state.iteration:
        clock.set(run.state.seconds)
    return run


def measure_whole(job: Job, budget: float, record: Record) -> Measurement:
    """One explicit run with the iterations of `job.params`, scored at its end."""
    clock = Clock(time_source(job.conditions.clock, job.conditions.threads))
    scene = read_scene(job.scene)
    with TemporaryDirectory() as folder:
        report = train_explicit(scene, explicit_of(job.params), Path(folder) / "model", Path(folder) / "log")
        with clock.paused():
            device = pick_device(job.params.device)
            scores = score(
                scene, load_model(Path(folder) / "model", device), job.conditions.frames, find_perceptual(device)
            )
    made = job.measurement(budget, clock.seconds, report.iterations, report.peak_memory_bytes, scores)
    record(made)
    return made


def score(scene: Scene, model: RadianceManifolds, frames: int, perceptual: Perceptual) -> Scores:
    """The model without its view branch on the held-out cameras, as `evaluate` scores its variant `diffuse`.

    Args:
        frames: of each camera, evenly spaced.

    Raises:
        UserError: if there is no held-out camera.
    """
    held_out = scene.indices("holdout")
    if not held_out:
        raise UserError(
            "no held-out camera: there is nothing to score on",
            file=scene.folder / "scene.json",
            remedy="name held-out cameras under subjects.<name>.holdout in params.yaml",
        )
    truths, masks = scene.open_frames(), scene.open_masks()
    found: list[dict[str, float | None]] = []
    for camera in held_out:
        view = ModelView(model, scene.cameras[camera])
        for k in spread(scene.num_frames, frames):
            if (camera, k) not in truths:
                continue
            picture = shown(view.render(float(k))[1])
            mask = None
            if masks is not None and (camera, k) in masks:
                mask = masks.image(camera, k)[..., 0] / 255.0
            found.append(score_images({"": picture}, truths.image(camera, k) / 255.0, mask, perceptual)[""])
    return _means(found)


def _means(images: list[dict[str, float | None]]) -> Scores:
    """Over the images that have a subject; over all and the whole frame if none has."""
    masked = [image for image in images if image["psnr_subject"] is not None]
    suffix = "_subject" if masked else ""

    def mean(name: str) -> float | None:
        values = [v for image in masked or images if (v := image[name + suffix]) is not None]
        return round(float(np.mean(values)), 5) if values else None

    psnr, ssim, lpips, st_lpips = (mean(name) for name in METRICS)
    assert psnr is not None and ssim is not None
    return Scores(
        region="subject" if masked else "frame",
        images=len(masked or images),
        psnr=psnr,
        ssim=ssim,
        lpips=lpips,
        st_lpips=st_lpips,
    )


def mlp_of(params: TrainParams) -> MlpParams:
    """The section of a perceptron preset."""
    if not isinstance(params, MlpParams):
        raise UserError("not a perceptron preset", expected="paper or quick", found=params.preset)
    return params


def explicit_of(params: TrainParams) -> ExplicitParams:
    """The section of an explicit preset."""
    if not isinstance(params, ExplicitParams):
        raise UserError("not an explicit preset", expected="fast", found=params.preset)
    return params
