"""Score the shipped files, and the model they came from, on the held-out cameras."""

from __future__ import annotations

import sys

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import read_scene
from facefolds_core.config import read_stage, read_train
from facefolds_core.files import atomic_folder, write_json
from facefolds_core.model import load_model
from facefolds_core.model.device import pick_device
from facefolds_core.params import EvaluateParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.analysis import shape_of
from facefolds_core.scoring.evaluation import evaluate, frame_rate_factor
from facefolds_core.scoring.perceptual import find_perceptual
from facefolds_core.scoring.record import write_record
from facefolds_core.scoring.report import metrics_json, read_cost, text_table, write_per_image
from facefolds_core.scoring.sheets import write_contact_sheet
from stages.common import run_stage


def evaluate_subject(folders: SubjectFolders) -> str:
    params = read_stage(EvaluateParams, folders.config)
    device = pick_device(read_train(folders.config).device)
    scene, asset = read_scene(folders.scene), read_asset(folders.asset)
    cost = read_cost(folders, asset.manifest)
    perceptual = find_perceptual(device)
    for line in perceptual.missing:
        sys.stderr.write(f"evaluate: {line}\n")
    result = evaluate(scene, load_model(folders.model, device), asset, params, perceptual)
    metrics = metrics_json(scene.subject, result.scores, cost)
    with atomic_folder(folders.evaluation) as temporary:
        write_per_image(result.scores, temporary / "per_image.parquet")
        write_contact_sheet(temporary / "contact_sheet.png", scene.subject, result.panels, metrics)
        write_record(temporary, result.panels, result.worst, result.seen, shape_of(asset), asset)
    write_json(folders.metrics, metrics)
    sys.stdout.write(text_table(metrics) + "\n")
    factor = frame_rate_factor(scene, asset)
    if factor > 1:
        kept = f"{scene.num_frames} of the asset's {asset.num_frames} frames"
        sys.stdout.write(f"evaluate: {kept} have photos and are scored, not those between them\n")
    return f"{metrics['images']} images of {len(scene.indices('holdout'))} held-out cameras; {folders.metrics}"


if __name__ == "__main__":
    run_stage("evaluate", evaluate_subject, __doc__ or "")
