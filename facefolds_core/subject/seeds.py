"""Where Gaussians begin: on rays of the training pictures, at the depth where the other pictures show the same."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, TURN

Array = NDArray[np.float32]

DEPTHS = 96
"""Places on a ray that are compared, evenly spread in inverse depth."""
REACH = (0.35, 12.0)
"""The nearest and the farthest of them, units: a camera is about 1 from the subject."""
SHARE = 0.4
"""A place is judged by this share of the pictures that see it, those that agree best: others see something before it."""
FEWEST = 2
"""Pictures that must see a place, beside the ray's own."""
LONG_SIDE = 160
"""Pictures are compared at this size, pixels."""
BLURS = (1.0, 3.0)
"""Standard deviations, pixels, of what is compared."""
BEGIN_OPACITY = 0.1
SIZE = 0.5
"""Standard deviation of a Gaussian in distances to its neighbours."""


def seeds(cameras: Sequence[Camera], pictures: Sequence[Array], count: int, random: np.random.Generator) -> Array:
    """Gaussians (count, COLUMNS) float32.

    Args:
        pictures: (H, W, 3) float32 in [0, 1], one a camera.
    """
    small = [_reduced(*pair) for pair in zip(cameras, pictures, strict=True)]
    which = np.arange(count) % len(cameras)
    values = np.zeros((count, COLUMNS), np.float32)
    for index, (camera, features) in enumerate(small):
        rows = which == index
        pixels = _stratified(int(rows.sum()), camera, random)
        origins, directions = camera.rays(pixels)
        inverse = (np.arange(DEPTHS) + random.random((len(pixels), 1))) / DEPTHS
        places = 1 / (1 / REACH[1] + inverse * (1 / REACH[0] - 1 / REACH[1]))
        own = _look_up(features, pixels)
        others = [pair for k, pair in enumerate(small) if k != index]
        points = origins[:, None] + places[..., None] * directions[:, None]
        best = np.argmin(_disagreement(points, own, others), 1)
        distance = places[np.arange(len(best)), best]
        apart = np.sqrt(camera.width * camera.height * len(cameras) / count) / camera.K[0, 0]
        values[rows, MEAN] = origins + distance[:, None] * directions
        values[rows, SCALE] = np.log(SIZE * apart * distance)[:, None]
        values[rows, COLOUR] = own[:, :3]
    values[:, TURN.start] = 1
    values[:, OPACITY] = np.log(BEGIN_OPACITY / (1 - BEGIN_OPACITY))
    return values


def _reduced(camera: Camera, picture: Array) -> tuple[Camera, Array]:
    """A smaller camera, and what is compared of its picture (h, w, 3 a blur)."""
    scale = min(1.0, LONG_SIDE / max(camera.width, camera.height))
    camera = camera.resized(max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))
    small = cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    blurred = [cv2.GaussianBlur(small, (0, 0), blur) for blur in BLURS]
    return camera, np.concatenate(blurred, -1).astype(np.float32)


def _stratified(count: int, camera: Camera, random: np.random.Generator) -> NDArray[np.float64]:
    """(count, 2) pixels, spread over the picture."""
    across = max(1, round(np.sqrt(count * camera.width / camera.height)))
    down = -(-count // across)
    cells = random.permutation(across * down)[:count]
    at = np.stack([cells % across, cells // across], -1) + random.random((count, 2))
    return np.asarray(at * [camera.width / across, camera.height / down])


def _look_up(features: Array, pixels: NDArray[np.float64]) -> Array:
    """Of pixels (..., 2), the nearest."""
    height, width = features.shape[:2]
    x = np.clip(pixels[..., 0].astype(np.int64), 0, width - 1)
    y = np.clip(pixels[..., 1].astype(np.int64), 0, height - 1)
    return features[y, x]


def _disagreement(points: NDArray[np.float64], own: Array, others: Sequence[tuple[Camera, Array]]) -> Array:
    """(R, D) mean difference of the best views of places (R, D, 3) on rays that show `own` (R, F); infinite where too
    few see them."""
    found = np.full((len(others), *points.shape[:2]), np.inf, np.float32)
    for index, (camera, features) in enumerate(others):
        pixels, depth = camera.project(points)
        inside = (pixels >= 0).all(-1) & (pixels[..., 0] < camera.width) & (pixels[..., 1] < camera.height)
        inside &= depth > 0
        difference = np.abs(_look_up(features, np.where(inside[..., None], pixels, 0)) - own[:, None]).mean(-1)
        found[index] = np.where(inside, difference, np.inf)
    found.sort(0)
    seen = np.isfinite(found).sum(0)
    used = np.maximum(np.ceil(SHARE * seen), FEWEST)
    counted = np.arange(len(others))[:, None, None] < used
    mean = np.where(counted, found, 0).sum(0) / used
    return np.where(seen >= FEWEST, mean, 10.0 - seen).astype(np.float32)
