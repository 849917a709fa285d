"""Which part of a volume is the subject: the body at the cameras' common centre, without the walls it touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.walls import Wall

Bool = NDArray[np.bool_]

EMPTY = math.log(math.expm1(1e-5))
"""Raw density of a voxel that holds nothing."""


def body_at_centre(volume: Volume, near: float, body_depth: float) -> Bool:
    """(X, Y, Z): the connected body with the most optical depth near the origin; all False where nothing is solid."""
    depth = np.logaddexp(0, volume.grid[..., 0])
    labels, count = ndimage.label(depth > body_depth)
    if count == 0:
        return np.zeros(depth.shape, bool)
    weight = np.exp(-0.5 * (distances(volume) / near) ** 2)
    mass = ndimage.sum_labels(depth * weight, labels, np.arange(1, count + 1))
    body: Bool = labels == 1 + int(np.argmax(mass))
    return body


def body_before(volume: Volume, walls: Sequence[Wall], params: ExplicitParams) -> Bool:
    """(X, Y, Z): the body at the centre of a volume with an outer zone, without what belongs to `walls`."""
    points = positions(volume)
    solid = volume.grid.copy()
    for wall in walls:
        solid[wall.height(points) < params.subject.walls.margin, 0] = EMPTY
    return body_at_centre(replace(volume, grid=solid), params.subject.near, params.subject.body_depth)


def subject_of(volume: Volume, walls: Sequence[Wall], params: ExplicitParams) -> Volume:
    """The volume with nothing in it but the subject; what was taken out is kept as `removed` where there is an outer
    zone.

    Args:
        walls: of `find_walls`; none without an outer zone.
    """
    if volume.room.outer:
        body = body_before(volume, walls, params)
    else:
        # Before a plain background there is no room to be told from a subject that is cut off by the ball.
        body = body_at_centre(volume, params.subject.near, params.volume.body_depth)
        if body.sum() == (np.logaddexp(0, volume.grid[..., 0]) > params.volume.body_depth).sum():
            return volume  # there is nothing else: faint hair around it stays, too
    kept = ndimage.binary_dilation(body, iterations=2)
    for wall in walls:
        kept &= wall.height(positions(volume)) >= params.subject.walls.margin
    grid = volume.grid.copy()
    grid[~kept, 0] = np.minimum(grid[~kept, 0], EMPTY)
    if not volume.room.outer:
        return replace(volume, grid=grid)
    removed = volume.grid.copy()
    removed[kept, 0] = np.minimum(removed[kept, 0], EMPTY)
    return replace(volume, grid=grid, removed=removed)


def positions(volume: Volume) -> NDArray[np.float64]:
    axes = [volume.lower[a] + volume.voxel * np.arange(n) for a, n in enumerate(volume.grid.shape[:3])]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1)


def distances(volume: Volume) -> NDArray[np.float64]:
    """(X, Y, Z) from the origin, units."""
    distance: NDArray[np.float64] = np.linalg.norm(positions(volume), axis=-1)
    return distance
