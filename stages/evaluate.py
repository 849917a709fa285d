"""Score the shipped files, and the model they came from, on the held-out cameras."""

from __future__ import annotations

import sys

from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.found_scene import found_scene
from facefolds_core.captures.scene import Scene
from facefolds_core.config import read_stage, read_subject, read_train
from facefolds_core.facts import Fact
from facefolds_core.files import atomic_folder, write_json
from facefolds_core.model import load_model
from facefolds_core.model.device import device_of
from facefolds_core.packaging.notes import codec_warning
from facefolds_core.params import CaptureParams, CompressParams, EvaluateParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.analysis import shape_of
from facefolds_core.scoring.evaluation import Evaluation, evaluate, frame_rate_factor
from facefolds_core.scoring.fresh import fresh_json, score_fresh_views
from facefolds_core.scoring.perceptual import find_perceptual
from facefolds_core.scoring.record import write_record
from facefolds_core.scoring.report import Circumstances, metrics_json, read_cost, write_per_image
from facefolds_core.scoring.sheets import write_contact_sheet
from facefolds_core.scoring.terminal import result_lines, score_lines
from facefolds_core.scoring.training_scores import bad_views, warnings_of
from facefolds_core.scoring.warnings import matte_is_found, stands_still, training_events, warnings_among
from stages.common import run_stage


def noticed(folders: SubjectFolders, scene: Scene, asset: Asset, result: Evaluation) -> tuple[Fact, ...]:
    """What is not well with the capture, the training, the files and the scores."""
    video = read_stage(CompressParams, folders.config)
    quality = asset.manifest.full.quality
    codec = codec_warning(quality.psnr_to_model if quality else None, video.video)
    limits = read_stage(EvaluateParams, folders.config).warnings
    return warnings_among(
        [
            *scene.left_out,
            *training_events(folders.model / "fit.json"),
            *([codec] if codec else []),
            *matte_is_found(result.matte),
            *warnings_of(result.training),
            *stands_still(result.changes.get("holdout", {}), scene.num_frames, limits),
        ]
    )


def evaluate_subject(folders: SubjectFolders) -> str:
    params = read_stage(EvaluateParams, folders.config)
    device = device_of(read_train(folders.config))
    scene, asset = found_scene(folders), read_asset(folders.asset)
    cost = read_cost(folders, asset.manifest)
    perceptual, model = find_perceptual(device), load_model(folders.model, device)
    with atomic_folder(folders.evaluation) as temporary:
        result = evaluate(scene, model, asset, params, perceptual, temporary, folders.checkpoints / "scores.npz")
        fresh = None
        if params.fresh_views and read_subject(folders.config).source == "actor":
            capture = read_stage(CaptureParams, folders.config)
            fresh = fresh_json(score_fresh_views(scene, model, asset, params, capture))
        warnings = noticed(folders, scene, asset, result)
        about = Circumstances(result.matte, params.band, result.changes, result.patch, result.training, fresh, warnings)
        metrics = metrics_json(scene.subject, result.scores, cost, about)
        write_per_image(result.scores, temporary / "per_image.parquet")
        write_contact_sheet(temporary / "contact_sheet.png", scene.subject, result.panels, metrics)
        write_record(
            temporary,
            result.panels,
            result.worst,
            result.seen,
            shape_of(asset),
            asset,
            films=result.films,
            patch=result.patch,
            training=bad_views(result.training),
        )
    write_json(folders.metrics, metrics)
    notes = list(perceptual.missing)
    factor = frame_rate_factor(scene, asset)
    if factor > 1:
        notes.append(f"{scene.num_frames} of the asset's {asset.num_frames} frames have photos and are scored")
    sys.stdout.write("\n".join([*score_lines(metrics), *(f"note: {note}" for note in notes)]) + "\n")
    return "\n".join([f"scores in {folders.metrics}", *result_lines(metrics, folders)])


if __name__ == "__main__":
    run_stage("evaluate", evaluate_subject, __doc__ or "")
