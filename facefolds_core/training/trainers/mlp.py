"""The paper's perceptrons: docs/reference/method.md."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from facefolds_core.params.mlp import QUICK
from facefolds_core.params.mlp import MlpParams as Params

if TYPE_CHECKING:
    from facefolds_core.captures.scene import Scene
    from facefolds_core.model.radiance import RadianceManifolds
    from facefolds_core.model.storage import ModelSpec
    from facefolds_core.training.report import TrainingReport

PRESETS: dict[str, dict[str, Any]] = {"paper": {}, "quick": QUICK}


def spec() -> type[ModelSpec]:
    from facefolds_core.model.storage import ModelSpec

    return ModelSpec


def build(spec: ModelSpec) -> RadianceManifolds:
    from facefolds_core.model.storage import build_mlp

    return build_mlp(spec)


def train(scene: Scene, params: Params, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    from facefolds_core.training.loop import train

    return train(scene, params, folder, checkpoints, log)
