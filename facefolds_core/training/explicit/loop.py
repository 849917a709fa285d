"""Training of the explicit model: geometry in rounds at coarse textures, then textures coarse to fine on stored
crossings. A short take simply starts again where it was interrupted; the base of a long one has checkpoints."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene, Split
from facefolds_core.facts import Fact
from facefolds_core.params import ExplicitParams, LossParams
from facefolds_core.progress import progress
from facefolds_core.subject.find import found_in, subject_in
from facefolds_core.subject.volume import volume_of
from facefolds_core.training.checkpoints import fingerprint
from facefolds_core.training.device import choose
from facefolds_core.training.explicit.cameras import choose_cameras
from facefolds_core.training.explicit.checkpoints import Checkpoints
from facefolds_core.training.explicit.fit import fit_scene
from facefolds_core.training.explicit.picture import draw_fit
from facefolds_core.training.explicit.plan import plan
from facefolds_core.training.explicit.state import model_bytes
from facefolds_core.training.explicit.targets import all_mattes
from facefolds_core.training.explicit.trainer import Trainer
from facefolds_core.training.explicit.views import check_images
from facefolds_core.training.explicit.warnings import warnings_of
from facefolds_core.training.few_cameras import for_scene
from facefolds_core.training.log import open_log
from facefolds_core.training.patience import check_space, patiently
from facefolds_core.training.report import TrainingReport, make_report
from facefolds_core.training.trained import Trained


def train_explicit(scene: Scene, params: ExplicitParams, model_folder: Path, log: Path) -> TrainingReport:
    """`fit_explicit`, and the model's folder written whole; a full disk is waited for."""
    trained = fit_explicit(scene, params, log, model_folder)
    patiently(lambda: trained.save(model_folder))
    return trained.report


def fit_explicit(scene: Scene, params: ExplicitParams, log: Path, place: Path | None = None) -> Trained:
    """Train on `scene`.

    Args:
        log: folder of dvclive's files.
        place: where the model is to be written: that it will fit there is checked before the training.

    Raises:
        UserError: if an image is missing, nothing stands out from the background, or training diverges even at small
            learning rates.
    """
    return fit_with_surroundings(scene, params, log, place)[0]


def for_notes(params: ExplicitParams, notes: Sequence[Fact]) -> ExplicitParams:
    """The parameters of the layers' geometry and training after what the volume's said.

    Where the subject was fog, backgrounds stay what the room shows (`background.rate` 0): those that learn would take
    up what is as pale as what stands behind it. Opacity costs nothing (`losses.opacity` 0), and nothing is cleared for
    looking like the room: it does. Layers lie as far apart as `max_halfwidth` lets them: where the surface is nobody
    knows to a few pixels.
    """
    if not any(note.kind == "fog" for note in notes):
        return params
    background = params.background.model_copy(update={"rate": 0.0})
    off = {"room_gain": 0.0, "beside_gain": 0.0, "beside_layers_gain": 0.0}
    pruning, losses = params.pruning.model_copy(update=off), params.losses.model_copy(update={"opacity": 0.0})
    geometry = params.geometry.model_copy(update={"max_halfwidth_pixels": math.inf})
    changed = {"background": background, "pruning": pruning, "losses": losses, "geometry": geometry}
    return params.model_copy(update=changed)


def for_mattes(params: ExplicitParams, scene: Scene) -> ExplicitParams:
    """The parameters of a training that knows the subject's opacity in every picture, or `params` where it does not:
    no background learns, opacity needs no price, and nothing is cleared for looking like a room."""
    if not all_mattes(scene):
        return params
    off = {"room_gain": 0.0, "beside_gain": 0.0, "beside_layers_gain": 0.0}
    changed = {
        "background": params.background.model_copy(update={"rate": 0.0}),
        "losses": params.losses.model_copy(update={"opacity": 0.0, "binarisation": 0.0}),
        "pruning": params.pruning.model_copy(update=off),
    }
    return params.model_copy(update=changed)


def for_poses(params: ExplicitParams, scene: Scene) -> ExplicitParams:
    """The parameters of the training of a head that turns, or `params` of one that does not."""
    if scene.poses is None:
        return params
    rate = min(params.background.rate, params.moving.background_rate)
    background = params.background.model_copy(update={"rate": rate})
    return params.model_copy(update={"background": background})


@dataclass(frozen=True)
class Surroundings:
    """What a training found out beside the model, and what frames are fitted with that come later.

    Attributes:
        splits: of the scene's cameras; of those that contradict the others "out".
        gains: (C, 3) of the training cameras that are left.
        background: (C, pixels, 3) float32, of the same.
        rate: the learning rate that it ended with.
        losses: its own, after `for_notes`.
        usual: (M, 3) mean errors of the texels in most frames.
    """

    splits: tuple[Split, ...]
    gains: NDArray[np.float64]
    background: NDArray[np.float32]
    rate: float
    losses: LossParams
    usual: NDArray[np.float32]


def fit_with_surroundings(
    scene: Scene, params: ExplicitParams, log: Path, place: Path | None = None, kept: Path | None = None
) -> tuple[Trained, Surroundings]:
    """`fit_explicit`, and what else was found out.

    Args:
        kept: folder of this very training's checkpoint, which the caller deletes; None keeps none.
    """
    check_images(scene)
    device = choose(params.device)
    checkpoints = None if kept is None else Checkpoints(kept, params.segments)
    began = time.perf_counter()
    used, _ = for_scene(params, scene)
    with open_log(log) as live:
        bar = progress(total=params.iterations, desc="train", unit="it")
        subject, found = subject_in(scene), ()
        volume = volume_of(subject.splats)
        cameras = choose_cameras(scene, subject.cameras)
        for note in (*found, *cameras.notes):
            bar.write(f"train: {note}")
        own = for_mattes(for_notes(for_poses(used, scene), found), scene)
        fit = fit_scene(cameras.scene, volume, subject.psnr, own)
        warnings = warnings_of(scene, fit, params.warnings)
        for note in (*fit.notes, *warnings):
            bar.write(f"train: {note}")
        if place is not None:
            check_space(place, model_bytes(fit.texels, params.layers, scene.num_frames))
        trainer = Trainer(cameras, own, fit, volume, device)
        trainer.events = [*found, *trainer.events, *warnings]
        pixels = len(cameras.scene.indices("train")) * scene.width * scene.height
        levels = plan(fit, params, scene.num_frames, pixels)
        bar.total = bar.n + sum(level.iterations for level in levels)
        begun = None
        if checkpoints is not None:
            begun = checkpoints.take_up(trainer, levels, live, bar)
            checkpoints.follow(trainer)
        for k in range(0 if begun is None else begun.level, len(levels)):
            trainer.run(levels[k], k, live, bar, begun)
            begun = None
        bar.close()
        patiently(live.make_summary)
    model, spec = trainer.result(fingerprint(params, scene))
    report = make_report(
        time.perf_counter() - began + (0.0 if checkpoints is None else checkpoints.before),
        trainer.iteration,
        device.name,
        device.peak_memory(),
        params.preset,
        trainer.rays,
        trainer.psnr,
    )
    draw = partial(draw_fit, fit=fit, layers=spec.num_layers, subject_opacity=params.start.subject_opacity)
    assert trainer.state is not None
    background = trainer.state.background.cpu().numpy()
    surroundings = Surroundings(
        cameras.scene.splits, cameras.gains, background, trainer.rate, own.losses, trainer.usual
    )
    return Trained(model, spec, report, trainer.summary(spec), draw), surroundings
