"""Which part of a volume is the subject: the body at the cameras' common centre, without the room it touches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.params import ExplicitParams, SubjectParams
from facefolds_core.training.volume.fit import Volume

Bool = NDArray[np.bool_]


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


def without_room(volume: Volume, body: Bool, params: SubjectParams) -> Bool:
    """The part of `body` that is nearer, through it, to what is at the common centre, or before it, than to what lies
    far behind it."""
    distance, points = distances(volume), positions(volume)
    own = body & ((distance < params.core) | (points[..., 0] > params.front))
    behind = (points[..., 0] < params.behind) & (points[..., 2] > -params.below * distance)
    room = body & (distance > params.rim) & behind
    if not own.any() or not room.any():
        return body
    # Both grow until they have shared the body out.
    before = -1
    while (now := int(own.sum() + room.sum())) != before:
        before = now
        own = ndimage.binary_dilation(own, mask=body & ~room)
        room = ndimage.binary_dilation(room, mask=body & ~own, iterations=params.room_speed)
    return own


def subject_of(volume: Volume, params: ExplicitParams) -> Volume:
    """The volume with nothing in it but the subject."""
    body = body_at_centre(volume, params.subject.near, params.volume.body_depth)
    # Before a plain background there is no room to be told from a subject that is cut off by the ball.
    if volume.room.outer:
        body = without_room(volume, body, params.subject)
    elif body.sum() == (np.logaddexp(0, volume.grid[..., 0]) > params.volume.body_depth).sum():
        return volume  # there is nothing else: faint hair around it stays, too
    kept = ndimage.binary_dilation(body, iterations=2)
    grid = volume.grid.copy()
    grid[~kept, 0] = np.minimum(grid[~kept, 0], math.log(math.expm1(1e-5)))
    return replace(volume, grid=grid)


def positions(volume: Volume) -> NDArray[np.float64]:
    axes = [volume.lower[a] + volume.voxel * np.arange(n) for a, n in enumerate(volume.grid.shape[:3])]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1)


def distances(volume: Volume) -> NDArray[np.float64]:
    """(X, Y, Z) from the origin, units."""
    distance: NDArray[np.float64] = np.linalg.norm(positions(volume), axis=-1)
    return distance
