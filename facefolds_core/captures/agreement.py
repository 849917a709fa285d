"""Whether the pictures agree about the tracked mesh: a point of it looks alike to cameras side by side.

Poses that are all inverted, or cameras whose names are mixed up, can look at the head as soundly as the true ones do;
what the pictures show there then has nothing to do with one another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera

Array = NDArray[np.float64]

AGREE = 0.5
"""Median correlation below which a note is made. Of four captures the true poses had 0.87 to 0.97; inverted, or each
camera with its neighbour's pose, 0.04 to 0.43."""
POINTS = 2000
"""Vertices that are looked at, at most."""
SHARED = 100
"""Vertices that two cameras must both see."""
FACING = 0.5
"""Least cosine between a vertex's normal and the direction to a camera that sees it."""
CONTRAST = 2.0
"""Least standard deviation of a picture's grey levels on the mesh, of 255: less shows nothing to compare."""


def agreement(
    cameras: Sequence[Camera], vertices: Array, faces: NDArray[np.integer], image: Callable[[int], NDArray[np.uint8]]
) -> float | None:
    """Median, over pairs of neighbouring cameras, of the correlation of the grey levels of vertices that both face.

    Args:
        cameras: C, of one moment.
        vertices: (V, 3) then.
        faces: (F, 3).
        image: camera's index -> (H, W, 3), its picture then.

    Returns:
        -1 to 1, or None where no two cameras see enough to compare.
    """
    normals = _normals(vertices, faces)
    some = slice(None, None, -(-len(vertices) // POINTS))
    points, normals = vertices[some], normals[some]
    levels = np.array([_levels(camera, points, normals, image(c)) for c, camera in enumerate(cameras)])
    to_cameras = np.array([camera.centre for camera in cameras]) - points.mean(0)
    to_cameras /= np.linalg.norm(to_cameras, axis=1, keepdims=True)
    found = []
    for c, towards in enumerate(to_cameras @ to_cameras.T):
        for other in [i for i in np.argsort(-towards) if i != c][:3]:
            both = np.isfinite(levels[c]) & np.isfinite(levels[other])
            a, b = levels[c][both], levels[other][both]
            if both.sum() >= SHARED and min(a.std(), b.std()) >= CONTRAST:
                found.append(float(np.corrcoef(a, b)[0, 1]))
    return float(np.median(found)) if found else None


def _normals(vertices: Array, faces: NDArray[np.integer]) -> Array:
    """(V, 3) unit normals of vertices; of those without faces 0."""
    normals = np.zeros_like(vertices)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for k in range(3):
        np.add.at(normals, faces[:, k], across)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))


def _levels(camera: Camera, points: Array, normals: Array, image: NDArray[np.uint8]) -> Array:
    """Grey level at each point, NaN where it faces away or lies outside the picture."""
    pixels, depth = camera.project(points)
    towards = camera.centre - points
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    inside = ((pixels >= 0) & (pixels < [camera.width, camera.height])).all(1)
    seen = (depth > 0) & inside & ((towards * normals).sum(1) > FACING)
    x, y = pixels[seen].astype(int).T
    levels = np.full(len(points), np.nan)
    levels[seen] = image[y, x].mean(1)
    return levels
