"""Radius maps and texels, fitted from the subject's Gaussians on: docs/reference/method.md."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from facefolds_core.params.explicit import ExplicitParams as Params

if TYPE_CHECKING:
    from facefolds_core.captures.scene import Scene
    from facefolds_core.model.radiance import RadianceManifolds
    from facefolds_core.model.storage import ExplicitSpec
    from facefolds_core.training.report import TrainingReport

PRESETS: dict[str, dict[str, Any]] = {"fast": {}}


def spec() -> type[ExplicitSpec]:
    from facefolds_core.model.storage import ExplicitSpec

    return ExplicitSpec


def build(spec: ExplicitSpec) -> RadianceManifolds:
    from facefolds_core.model.storage import build_explicit

    return build_explicit(spec)


def train(scene: Scene, params: Params, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    from facefolds_core.training.segments.loop import train_take

    return train_take(scene, params, folder, checkpoints, log)
