"""What the cameras that the asset was trained on see of it: a camera on which even the training failed (a wrong
calibration, say) does not show in scores of held-out ones. `evaluate` keeps the figures in metrics.json."""

from __future__ import annotations

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.params import EvaluateParams
from facefolds_core.progress import progress
from facefolds_core.rendering.areas import view_of
from facefolds_core.scoring.backgrounds import Cutout, Rendering, squared_error
from facefolds_core.scoring.matte import opacity_errors
from facefolds_core.scoring.metrics import decibels, psnr, shown
from facefolds_core.scoring.training_scores import TrainingView
from facefolds_core.scoring.truths import Truth, Truths


def training_views(scene: Scene, asset: Asset, params: EvaluateParams) -> list[TrainingView]:
    """The scene's middle frame from every training camera that has a photo of it; shows a progress bar."""
    truths, frame = Truths(scene), scene.num_frames // 2
    textures = asset.frame(frame)
    cameras = [index for index in scene.indices("train") if (index, frame) in truths]
    found = []
    with progress(total=len(cameras), desc="training views", unit="image") as bar:
        for index in cameras:
            seen = Rendering(*view_of(asset.full, scene.cameras[index], frame).composite(textures))
            truth = truths.at(index, frame)
            over = shown(seen.over(params.background if truth.plate is None else truth.plate))
            values = score(seen, truth, params)
            found.append(TrainingView(scene.cameras[index].name, scene.frame_ids[frame], values, truth.picture, over))
            bar.update()
    return found


def score(seen: Rendering, truth: Truth, params: EvaluateParams) -> dict[str, float | None]:
    """METRICS, and the errors of opacity against the matte that training may use."""
    plate = None if truth.plate is None else psnr(shown(seen.over(truth.plate)), truth.picture)
    where_opaque = psnr(shown(seen.over(params.background)), truth.picture, seen.opacity)
    values: dict[str, float | None] = {"psnr_any": None, "psnr_over_plate": plate, "psnr_found": where_opaque}
    if truth.matte is None:
        return values
    cutout = Cutout.of(truth.picture, truth.matte, truth.plate)
    values["psnr_any"] = decibels(float(squared_error(seen.rgb, seen.opacity, cutout).mean()))
    return values | opacity_errors(seen.opacity, cutout.opacity)
