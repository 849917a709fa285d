"""Walls, floors and tables in a volume: large flat things with nothing behind them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import WallParams

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Wall:
    """The plane n . x = offset; unit normal n (3,) towards the cameras, units."""

    normal: Array
    offset: float

    def height(self, points: Array) -> Array:
        """(...) how far points (..., 3) stand before it, units; negative behind."""
        height: Array = points @ self.normal - self.offset
        return height


def find_walls(points: Array, cameras: Sequence[Camera], voxel: float, params: WallParams) -> tuple[Wall, ...]:
    """The walls among what the cameras see, one after the other, the largest first.

    A wall is a plane that many points lie on (RANSAC, then least squares), spread widely in both directions, with all
    cameras before it and next to nothing behind it: planes through a head have half of the head behind them.

    Args:
        points: (P, 3) of the visible surface, units.
        voxel: of the volume that they come from, units.
    """
    random = np.random.default_rng(params.seed)
    centres = np.array([camera.centre for camera in cameras])
    rest, found = points, list[Wall]()
    while len(found) < params.most and len(rest) >= params.points:
        tolerance = params.tolerance * voxel
        wall, inside, spread = _largest_plane(rest, tolerance, centres.mean(0), params, random)
        height = wall.height(points)
        behind = float((height < -2 * tolerance).mean())
        if spread < params.spread or behind > params.behind or (wall.height(centres) < 0).any():
            break
        found.append(wall)
        rest = rest[~inside]
    return tuple(found)


def _largest_plane(
    points: Array, tolerance: float, before: Array, params: WallParams, random: np.random.Generator
) -> tuple[Wall, NDArray[np.bool_], float]:
    """The plane with most of `points` (P, 3) within `tolerance`; which they are; their spread along it, the smaller of
    the two standard deviations. Its normal points to the side of `before` (3,)."""
    sample = points[random.choice(len(points), min(len(points), params.points), replace=False)]
    corners = sample[random.integers(len(sample), size=(params.trials, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-9  # three points on a line span no plane
    if not proper.any():
        return Wall(np.array([1.0, 0.0, 0.0]), 0.0), np.zeros(len(points), bool), 0.0
    normals = normals[proper] / lengths[proper, None]
    offsets = (normals * corners[proper, 0]).sum(1)
    counts = [int((np.abs(sample @ n - o) < tolerance).sum()) for n, o in zip(normals, offsets, strict=True)]
    best = int(np.argmax(counts))
    normal, offset, spread = normals[best], offsets[best], 0.0
    inside = np.abs(points @ normal - offset) < tolerance
    for _ in range(5):
        if inside.sum() < 3:
            break
        middle = points[inside].mean(0)
        values, axes = np.linalg.eigh(np.cov((points[inside] - middle).T))
        normal, offset, spread = axes[:, 0], float(middle @ axes[:, 0]), float(np.sqrt(max(values[1], 0.0)))
        inside = np.abs(points @ normal - offset) < tolerance
    if before @ normal < offset:
        normal, offset = -normal, -offset
    return Wall(normal, float(offset)), inside, spread
