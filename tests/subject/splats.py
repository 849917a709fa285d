"""Gaussians for tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.subject.cameras import CameraFit
from facefolds_core.subject.splats import COLUMNS, Splats
from facefolds_core.subject.storage import FoundSubject


def some_splats(count: int, seed: int = 0) -> NDArray[np.float32]:
    """Near the origin, of many sizes and colours, (count, COLUMNS)."""
    random = np.random.default_rng(seed)
    values = random.normal(0, 1, (count, COLUMNS)).astype(np.float32)
    values[:, :3] *= 0.15
    values[:, 3:6] = values[:, 3:6] * 0.4 - 3.2
    values[:, 10] += 0.5
    values[:, 11:14] = random.random((count, 3))
    values[:, 14:23] *= 0.1
    return values


def found(scene: Scene, psnr: float) -> FoundSubject:
    """Some of them as a scene's subject that explains its pictures with so many dB."""
    return FoundSubject(
        Splats(some_splats(200), np.zeros(3, np.float32)), psnr, CameraFit.alike(len(scene.indices("train")))
    )
