"""The models by name: what trains each. Their keys are in params/train.py, their files in model/storage.py."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from facefolds_core.captures.scene import Scene
from facefolds_core.params import TrainParams
from facefolds_core.training.loop import fit_mlp
from facefolds_core.training.loop import train as train_mlp
from facefolds_core.training.report import TrainingReport
from facefolds_core.training.segments.loop import fit_take, train_take
from facefolds_core.training.trained import Trained

FITTERS: dict[str, Callable[[Scene, Any, Path, Path], Trained]] = {
    "explicit": fit_take,
    "mlp": fit_mlp,
}
"""Model -> fit(scene, params, folder of checkpoints, folder of the log)."""

TRAINERS: dict[str, Callable[[Scene, Any, Path, Path, Path], TrainingReport]] = {
    "explicit": train_take,
    "mlp": train_mlp,
}
"""Model -> the same, with the model's folder, which is written whole, before the others."""


def fit(scene: Scene, params: TrainParams, checkpoints: Path, log: Path) -> Trained:
    """Train the model that `params` are of."""
    return FITTERS[params.model](scene, params, checkpoints, log)


def train(scene: Scene, params: TrainParams, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    """The same, and write the model's folder."""
    return TRAINERS[params.model](scene, params, folder, checkpoints, log)
