"""Which frames of a take look alike, and a few that differ most."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.progress import progress
from facefolds_core.spacing import spread

Float = NDArray[np.float32]

CAMERAS = 4
"""Training cameras whose pictures tell frames apart."""

THUMBNAIL = 32
"""Rows of the small grey pictures that are compared."""

VERTICES = 512
"""Vertices of a tracked mesh that are compared, at most."""


def likenesses(scene: Scene) -> list[Float]:
    """By what frames are told apart, each (K, D): small grey pictures of a few training cameras and, where the scene
    has them, the tracked meshes in the head's own frame."""
    train = scene.indices("train")
    cameras = spread(train, CAMERAS)
    rows = min(THUMBNAIL, scene.height)
    size = (max(1, round(scene.width * rows / scene.height)), rows)
    store = scene.open_frames()
    found = np.empty((scene.num_frames, len(cameras), size[1], size[0]), np.float32)
    for k in progress(range(scene.num_frames), desc="likeness", unit="frame"):
        for position, camera in enumerate(cameras):
            small = cv2.resize(store.image(camera, k), size, interpolation=cv2.INTER_AREA)
            found[k, position] = small.mean(-1)
    surface = scene.load_surface()
    meshes = []
    if surface is not None:
        step = -(-surface[0].shape[1] // VERTICES)
        meshes = [np.ascontiguousarray(surface[0][:, ::step]).reshape(len(found), -1)]
    return [found.reshape(len(found), -1), *meshes]


def comparable(parts: Sequence[Float], frames: Sequence[int] | None = None) -> Float:
    """(K, D) a row a frame: each part less its mean over `frames` (all, by default), its mean square there being 1."""
    scaled = []
    for part in parts:
        among = part if frames is None else part[list(frames)]
        mean = among.mean(0, dtype=np.float64).astype(np.float32)
        spread = np.float32(np.sqrt(np.square(among - mean, dtype=np.float64).sum(1).mean()))
        scaled.append((part - mean) / (spread if spread > 0 else np.float32(1)))
    return np.asarray(np.concatenate(scaled, 1), np.float32)


def squares(rows: Float, to: Float) -> NDArray[np.float64]:
    """(K,) squared distances of rows (K, D) to a row (D,); not by a matrix product, whose bits depend on threads."""
    return np.asarray(np.square(rows - to).sum(1, dtype=np.float64))


def farthest_first(rows: Float, count: int, first: int | None = None) -> list[int]:
    """Numbers of `count` frames in their order: `first`, by default the one nearest the mean, then always the farthest
    from all chosen."""
    chosen = [int(squares(rows, np.zeros_like(rows[0])).argmin()) if first is None else first]
    distance = squares(rows, rows[chosen[0]])
    while len(chosen) < min(count, len(rows)):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, squares(rows, rows[chosen[-1]]))
    return sorted(set(chosen))
