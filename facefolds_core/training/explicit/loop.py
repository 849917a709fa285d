"""Training of the explicit model: geometry in rounds at coarse textures, then textures coarse to fine on stored
crossings. What was interrupted starts again."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene, Split
from facefolds_core.facts import Fact, fact
from facefolds_core.model.device import CPU
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.subject.find import subject_in
from facefolds_core.training.checkpoints import fingerprint
from facefolds_core.training.explicit.cameras import choose_cameras
from facefolds_core.training.explicit.fit import Fit, fit_scene
from facefolds_core.training.explicit.plan import plan
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.teacher import MIN_START_PSNR, Teacher
from facefolds_core.training.explicit.trainer import Trainer
from facefolds_core.training.explicit.views import check_images
from facefolds_core.training.log import open_log
from facefolds_core.training.report import Trained, device_name, make_report, peak_memory

MAX_LOST = 0.05
"""Largest share of the visible surface without a place in the chart that nobody need be told of."""


def fit_explicit(scene: Scene, params: ExplicitParams, log: Path) -> Trained:
    """Train on a scene whose subject was found.

    Args:
        log: folder of dvclive's files.

    Raises:
        UserError: if an image, its matte or the subject is missing, or training diverges even at small learning rates.
    """
    return fit_with_surroundings(scene, params, log)[0]


@dataclass(frozen=True)
class Surroundings:
    """What a training found out beside the model, and what frames are fitted with that come later.

    Attributes:
        splits: of the scene's cameras; of those that contradict the others "out".
        gains: (C, 3) of the training cameras that are left.
        usual: (M, 3) mean errors of the texels in most frames.
    """

    splits: tuple[Split, ...]
    gains: NDArray[np.float64]
    usual: NDArray[np.float32]


def fit_with_surroundings(scene: Scene, params: ExplicitParams, log: Path) -> tuple[Trained, Surroundings]:
    """`fit_explicit`, and what else was found out."""
    check_images(scene)
    began = time.perf_counter()
    with open_log(log) as live:
        bar = progress(total=params.iterations, desc="train", unit="it")
        subject = subject_in(scene)
        cameras = choose_cameras(scene, subject.cameras)
        for note in cameras.notes:
            bar.write(f"train: {note}")
        teacher = Teacher(cameras.scene, subject, params.seed)
        pictures = CutOuts(cameras.scene, cameras.gains, teacher=teacher)
        fit = fit_scene(cameras.scene, subject, params, teacher.others(pictures.photos))
        warnings = warnings_of(scene, fit)
        for note in (*fit.notes, *warnings):
            bar.write(f"train: {note}")
        trainer = Trainer(cameras, params, fit, pictures, teacher)
        trainer.events = [*trainer.events, *warnings]
        pixels = len(cameras.scene.indices("train")) * scene.width * scene.height
        levels = plan(fit, params, scene.num_frames, pixels)
        bar.total = bar.n + sum(level.iterations for level in levels)
        for k, level in enumerate(levels):
            trainer.run(level, k, live, bar)
        bar.close()
        live.make_summary()
    model, spec = trainer.result(fingerprint(params, scene))
    report = make_report(
        time.perf_counter() - began,
        trainer.iteration,
        device_name(CPU),
        peak_memory(CPU),
        params.preset,
        trainer.rays,
        trainer.psnr,
    )
    surroundings = Surroundings(cameras.scene.splits, cameras.gains, trainer.usual)
    return Trained(model, spec, report, params, trainer.summary(spec)), surroundings


def warnings_of(scene: Scene, fit: Fit) -> tuple[Fact, ...]:
    """What a user should look at before believing a training that ended well, one for each thing that is not well; its
    words say what to do."""
    found = []
    if fit.start_psnr < MIN_START_PSNR:
        found.append(fact("start_explains_little", psnr=fit.start_psnr, under=MIN_START_PSNR))
    lost = fit.losses[fit.chart]
    if lost > MAX_LOST:
        found.append(fact("surface_without_a_place", share=lost, x=fit.chart.centre[0]))
    if any(line.kind == "front_found" for line in scene.left_out):
        found.append(fact("front_is_guessed"))
    return tuple(found)
