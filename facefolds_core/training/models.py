"""Training by the model that the parameters are of (facefolds_core/models)."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.captures.scene import Scene
from facefolds_core.params import TrainParams
from facefolds_core.registry import MODELS
from facefolds_core.training.report import TrainingReport
from facefolds_core.training.trained import Trained


def fit(scene: Scene, params: TrainParams, checkpoints: Path, log: Path) -> Trained:
    """Train.

    Args:
        checkpoints, log: folders, of what lasts as long as the training and of dvclive's files.
    """
    trained: Trained = MODELS[params.model].fit(scene, params, checkpoints, log)
    return trained


def train(scene: Scene, params: TrainParams, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    """The same, and write the model's folder, whole: by the model's own `train`, if it has one."""
    own = getattr(MODELS[params.model], "train", None)
    if own is None:
        trained = fit(scene, params, checkpoints, log)
        trained.save(folder)
        return trained.report
    report: TrainingReport = own(scene, params, folder, checkpoints, log)
    return report
