"""Where Gaussians begin: where neighbouring pictures agree on a depth, else somewhere behind the subject."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, TURN
from facefolds_core.subject.sweep import REACH, WINDOW, depth_maps, places

Array = NDArray[np.float32]

AGREE = 2.0
"""Pictures that must find the same depth, the mean around a pixel."""
OPACITIES = (0.5, 0.1)
"""Of Gaussians whose depth is known, and of others."""
INSIDE = 0.5
"""Opacity from which on a pixel is the subject's."""
SIZE = 0.5
"""Standard deviation of a Gaussian in distances to its neighbours."""


def seeds(
    cameras: Sequence[Camera],
    pictures: Sequence[Array],
    count: int,
    ball: float,
    random: np.random.Generator,
    opacities: Sequence[Array] | None = None,
) -> Array:
    """Gaussians (count, COLUMNS) float32.

    Args:
        pictures: (H, W, 3) float32 in [0, 1], one a camera.
        ball: radius about the origin, units, in which the subject is looked for.
        opacities: (H, W) in [0, 1] of the subject, where nothing else is to be explained; None without.
    """
    values = np.zeros((count, COLUMNS), np.float32)
    which = np.arange(count) % len(cameras)
    for index, (camera, picture, depth, agree) in enumerate(zip(*depth_maps(cameras, pictures, ball), strict=True)):
        rows = np.flatnonzero(which == index)
        inside = None if opacities is None else cv2.resize(opacities[index], depth.shape[::-1]) > INSIDE
        x, y = _stratified(2 * len(rows), camera, inside, random)
        known = (cv2.blur(agree.astype(np.float32), (WINDOW, WINDOW)) >= AGREE)[y, x]
        # Half of them of known depth, where there are so many.
        order = np.argsort(~known, kind="stable")
        half = min(int(known.sum()), max(len(rows) // 2, len(rows) - int((~known).sum())))
        taken = np.concatenate([order[:half], order[::-1][: len(rows) - half]])
        x, y, known = x[taken], y[taken], known[taken]
        middle = float(camera.w2c[2, 3])
        near, far = middle + ball, max(REACH[1], 2 * (middle + ball))
        if inside is not None:
            near, far = max(middle - ball, 0.5 * middle), middle + ball
        unknown = 1 / (1 / near + random.random(len(x)) * (1 / far - 1 / near))
        here = np.where(known, depth[y, x], unknown).astype(np.float32)
        full = depth.copy()
        full[y, x] = here
        pixels = camera.width * camera.height if inside is None or not inside.any() else int(inside.sum())
        apart = np.sqrt(pixels * len(cameras) / count) / camera.K[0, 0]
        values[rows, MEAN] = places(camera, full)[y, x]
        values[rows, SCALE] = np.log(SIZE * apart * here)[:, None]
        values[rows, COLOUR] = picture[y, x]
        opacity = np.where(known, *OPACITIES)
        values[rows, OPACITY] = np.log(opacity / (1 - opacity))
    values[:, TURN.start] = 1
    return values


def _stratified(
    count: int, camera: Camera, inside: NDArray[np.bool_] | None, random: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Columns and rows of pixels, spread over the picture, or over the part of it that is `inside`."""
    share = 1.0 if inside is None or not inside.any() else float(inside.mean())
    cells = count / share
    across = max(1, round(np.sqrt(cells * camera.width / camera.height)))
    down = max(1, int(np.ceil(cells / across)))
    order = random.permutation(across * down)
    x = ((order % across + random.random(len(order))) * camera.width / across).astype(np.int64)
    y = ((order // across + random.random(len(order))) * camera.height / down).astype(np.int64)
    if inside is not None and inside.any():
        kept = np.flatnonzero(inside[y, x])
        kept = kept if len(kept) else np.arange(len(x))
        kept = np.resize(kept, count)
        return x[kept], y[kept]
    return x[:count], y[:count]
