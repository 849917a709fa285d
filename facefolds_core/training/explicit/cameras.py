"""Which training cameras are used, and with which gains: what the volume found out about each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.subject.cameras import CameraFit


@dataclass(frozen=True)
class CameraChoice:
    """Cameras of the stages after the volume.

    Attributes:
        scene: cameras that are left out have the split "out".
        gains: (C, 3) of the training cameras that are left.
        notes: a fact for each thing that a user should know.
        summary: for `fit.json`.
    """

    scene: Scene
    gains: NDArray[np.float64]
    notes: tuple[Fact, ...]
    summary: dict[str, object]


def choose_cameras(scene: Scene, found: CameraFit) -> CameraChoice:
    """Leave out cameras that contradict the others; keep the gains of those that remain.

    Args:
        found: of the scene's training cameras, in their order.
    """
    train, outliers = scene.indices("train"), found.outliers
    names = [scene.cameras[i].name for i in train]
    out = [train[position] for position in outliers]
    splits = tuple("out" if i in out else split for i, split in enumerate(scene.splits))
    median = float(np.nanmedian(found.errors)) if np.isfinite(found.errors).any() else 0.0
    notes = [fact("camera_contradicts", camera=names[p], times=float(found.errors[p] / median)) for p in outliers]
    if (found.gains != 1).any():
        low, high = found.gains.min(0), found.gains.max(0)
        spans = {c: [float(a), float(b)] for c, a, b in zip("rgb", low, high, strict=True)}
        notes.append(fact("gains", **spans))
    summary: dict[str, object] = {
        name: {
            "gain": [round(float(v), 4) for v in found.gains[p]],
            "measured_gain": [round(float(v), 4) for v in found.measured[p]],
            "error": None if np.isnan(found.errors[p]) else round(float(found.errors[p]), 5),
            "used": p not in outliers,
        }
        for p, name in enumerate(names)
    }
    kept = [p for p in range(len(names)) if p not in outliers]
    return CameraChoice(replace(scene, splits=splits), found.gains[kept], tuple(notes), summary)
