"""Score the shipped files, and the model they came from, on the held-out cameras."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.found_scene import found_scene
from facefolds_core.captures.scene import Scene
from facefolds_core.config.stages import read_stage, read_train
from facefolds_core.facts import WARNINGS, Fact, fact, read_fact
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.reading import is_there
from facefolds_core.files.writing import atomic_folder, read_json, write_json
from facefolds_core.model import load_model
from facefolds_core.model.device import device_of
from facefolds_core.packaging.notes import codec_warning
from facefolds_core.params import EvaluateParams
from facefolds_core.scoring.evaluation import evaluate as score
from facefolds_core.scoring.films import FILMS
from facefolds_core.scoring.panels import Evaluation
from facefolds_core.scoring.perceptual import find_perceptual
from facefolds_core.scoring.pictures import WORST, write_contact_sheet, write_training_views, write_worst
from facefolds_core.scoring.report import metrics_json, read_cost, write_per_image
from facefolds_core.scoring.temporal import Change
from facefolds_core.scoring.terminal import result_lines, score_lines
from facefolds_core.scoring.training_scores import bad_views, warnings_of

LEAST_EXPLAINED = 0.2
"""Share of the variance over time that an asset should explain."""
LEAST_FRAMES = 8
"""With fewer nothing is said of the change over time."""
LEAST_CHANGE = 0.004
"""RMS of the photos' change over time, colours in [0, 1], above which it is more than noise."""


def noticed(folders: SubjectFolders, scene: Scene, asset: Asset, result: Evaluation) -> tuple[Fact, ...]:
    """What is not well with the capture, the training, the files and the scores."""
    codec = codec_warning(asset.manifest.full.quality)
    return warnings_among(
        [
            *scene.left_out,
            *training_events(folders.model / "fit.json"),
            *([codec] if codec else []),
            *([fact("matte_is_found")] if result.matte == "found" else []),
            *warnings_of(result.training),
            *stands_still(result.changes.get("holdout", {}), scene.num_frames),
        ]
    )


def stands_still(changes: Mapping[str, Change], frames: int) -> list[Fact]:
    """A fact where little of what changes from frame to frame is shown.

    Args:
        changes: by variant.
        frames: of the scene.
    """
    asset, model = changes.get("asset"), changes.get("model")
    if asset is None or model is None or asset.temporal is None or model.temporal is None:
        return []
    moves = frames >= LEAST_FRAMES and (asset.truth_change or 0.0) >= LEAST_CHANGE
    if not moves or asset.temporal >= LEAST_EXPLAINED:
        return []
    return [fact("stands_still", asset=asset.temporal, model=model.temporal, under=LEAST_EXPLAINED)]


def training_events(fit: Path) -> list[Fact]:
    """What happened to a training, from its fit.json; nothing where it has none, and what is no fact is left out."""
    if not is_there(fit):
        return []
    value: Any = read_json(fit, remedy="run `dvc repro`: the stage train will run again")
    events = value.get("events") if isinstance(value, dict) else None
    found = []
    for event in events if isinstance(events, list) else []:
        try:
            found.append(read_fact(event))
        except ValueError:
            continue
    return found


def warnings_among(facts: Sequence[Fact]) -> tuple[Fact, ...]:
    """Those that ask for something to be done, each once."""
    return tuple({str(one): one for one in facts if one.kind in WARNINGS}.values())


def evaluate(folders: SubjectFolders) -> str:
    params = read_stage(EvaluateParams, folders.config)
    device = device_of(read_train(folders.config))
    scene, asset = found_scene(folders), read_asset(folders.asset)
    cost = read_cost(folders, asset.manifest)
    perceptual, model = find_perceptual(device), load_model(folders.model, device)
    with atomic_folder(folders.evaluation) as temporary:
        result = score(scene, model, asset, params, perceptual, temporary)
        warnings = noticed(folders, scene, asset, result)
        metrics = metrics_json(scene.subject, result, cost, warnings)
        write_per_image(result.scores, temporary / "per_image.parquet")
        write_contact_sheet(temporary / "contact_sheet.png", scene.subject, result.panels, metrics)
        write_worst(temporary / WORST, result.worst, result.patch)
        write_training_views(temporary / "pictures", bad_views(result.training))
        write_json(temporary / FILMS, [asdict(film) for film in result.films])
    write_json(folders.metrics, metrics)
    table = [*score_lines(metrics), *(f"note: {note}" for note in perceptual.missing)]
    return "\n".join([f"scores in {folders.metrics}", *table, *result_lines(metrics, folders)])
