"""What the cameras that the asset was trained on see of it: where it fails there, no held-out figure says why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.params import EvaluateParams
from facefolds_core.progress import progress
from facefolds_core.rendering.areas import view_of
from facefolds_core.scoring.backgrounds import Cutout, squared_error
from facefolds_core.scoring.images import Rendering
from facefolds_core.scoring.matte import opacity_errors
from facefolds_core.scoring.metrics import Array, decibels, psnr, shown
from facefolds_core.scoring.truths import Truth, Truths

BEHIND = 5.0
"""dB under the median of the training views from which on one is said to be bad."""

METRICS = ("psnr_any", "psnr_over_plate", "psnr_found")
"""By which they are compared: the first that all of them have."""


@dataclass(frozen=True)
class TrainingView:
    """One training camera's picture of the asset, of one frame.

    Attributes:
        camera, frame: their names.
        values: METRICS and the errors of opacity; None where one cannot be had.
        truth, asset: (H, W, 3) the photo, and the asset over the plate or over black.
    """

    camera: str
    frame: str
    values: dict[str, float | None]
    truth: Array
    asset: Array


def training_views(scene: Scene, asset: Asset, params: EvaluateParams) -> list[TrainingView]:
    """The scene's middle frame from every training camera that has a photo of it; shows a progress bar."""
    truths, frame = Truths(scene), scene.num_frames // 2
    time = frame * (asset.num_frames // scene.num_frames)
    textures = asset.frame(time)
    cameras = [index for index in scene.indices("train") if (index, frame) in truths]
    found = []
    with progress(total=len(cameras), desc="training views", unit="image") as bar:
        for index in cameras:
            seen = Rendering(*view_of(asset.full, scene.cameras[index], time).composite(textures))
            truth = truths.at(index, frame)
            over = shown(seen.over(params.background if truth.plate is None else truth.plate))
            values = score(seen, truth, params)
            found.append(TrainingView(scene.cameras[index].name, scene.frame_ids[frame], values, truth.picture, over))
            bar.update()
    return found


def score(seen: Rendering, truth: Truth, params: EvaluateParams) -> dict[str, float | None]:
    """METRICS, and the errors of opacity against the matte that training may use."""
    alpha = np.clip(seen.alpha.astype(np.float64), 0, 1)
    plate = None if truth.plate is None else psnr(shown(seen.over(truth.plate)), truth.picture)
    found = psnr(shown(seen.over(params.background)), truth.picture, alpha)
    values: dict[str, float | None] = {"psnr_any": None, "psnr_over_plate": plate, "psnr_found": found}
    if truth.matte is None:
        return values
    cutout = Cutout.of(truth.picture, truth.matte, truth.plate)
    values["psnr_any"] = decibels(float(squared_error(seen.rgb, alpha, cutout).mean()))
    return values | opacity_errors(alpha, cutout.opacity, params.band)


def compared_by(views: Sequence[TrainingView]) -> str | None:
    """The metric by which all of them can be compared."""
    return next((name for name in METRICS if all(view.values[name] is not None for view in views)), None)


def bad_views(views: Sequence[TrainingView]) -> list[TrainingView]:
    """Those that are `BEHIND` the median, worst first."""
    name = compared_by(views)
    if not views or name is None:
        return []
    median = float(np.median([view.values[name] or 0.0 for view in views]))
    bad = [view for view in views if (view.values[name] or 0.0) < median - BEHIND]
    return sorted(bad, key=lambda view: view.values[name] or 0.0)


def warnings_of(views: Sequence[TrainingView]) -> list[Fact]:
    """A fact for each bad view."""
    name = compared_by(views)
    if name is None:
        return []
    median = float(np.median([view.values[name] or 0.0 for view in views])) if views else 0.0
    return [
        fact("training_view_bad", camera=view.camera, frame=view.frame, psnr=view.values[name], median=median)
        for view in bad_views(views)
    ]
