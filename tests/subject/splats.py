"""Gaussians for tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.drawing import draw, view_of
from facefolds_core.subject.splats import COLUMNS, Splats
from facefolds_core.subject.storage import FoundSubject
from tests.scenes import cameras_alike


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


def some(count: int = 300) -> Splats:
    """The same before black."""
    return Splats(some_splats(count), np.zeros(3, np.float32))


def drawn(splats: Splats, cameras: Sequence[Camera]) -> NDArray[np.uint8]:
    """(C, H W, 4) cut-outs of all cameras."""
    seen = [draw(splats.values, view_of(camera)).picture() for camera in cameras]
    whole = [np.concatenate([rgb, 1 - light[..., None]], -1).reshape(-1, 4) for rgb, light in seen]
    return np.rint(255 * np.clip(whole, 0, 1)).astype(np.uint8)


def found(scene: Scene, psnr: float) -> FoundSubject:
    """Some of them as a scene's subject that explains its pictures with so many dB."""
    return FoundSubject(some(200), psnr, cameras_alike(len(scene.indices("train"))))
