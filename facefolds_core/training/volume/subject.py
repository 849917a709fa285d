"""Which part of a volume is the subject: the body at the cameras' common centre, without the room it touches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.training.volume.fit import Volume

Bool = NDArray[np.bool_]

SOLID_DEPTH = 0.1
"""Optical depth of a voxel from which on it belongs to a body."""

NEAR = 0.15
"""Standard deviation of the weight, over the distance from the common centre, with which bodies are compared, units."""

CORE = 0.25
"""What lies within this part of the ball's radius around the common centre is the subject's own."""

RIM = 0.9
"""What lies beyond this part of it, behind and not below, is the room's: a wall goes on, a head ends."""

BEHIND = 0.2
"""What has x below this part of the radius is behind: the cameras' common centre may lie a little behind a face."""

FASTER = 2
"""The room grows by so many voxels while the subject grows by one: a wall is larger than what hangs on it."""

BELOW = 0.35
"""Directions that fall by more (the sine) are below: there a subject goes on, too."""


def body_at_centre(volume: Volume) -> Bool:
    """(X, Y, Z): the connected body with the most optical depth near the origin; all False where nothing is solid."""
    depth = np.logaddexp(0, volume.grid[..., 0])
    labels, count = ndimage.label(depth > SOLID_DEPTH)
    if count == 0:
        return np.zeros(depth.shape, bool)
    weight = np.exp(-0.5 * (_distance(volume) / NEAR) ** 2)
    mass = ndimage.sum_labels(depth * weight, labels, np.arange(1, count + 1))
    body: Bool = labels == 1 + int(np.argmax(mass))
    return body


def without_room(volume: Volume, body: Bool) -> Bool:
    """The part of `body` that is nearer, through it, to what is at the common centre than to what touches the ball's
    rim behind the centre."""
    distance, points = _distance(volume), _points(volume)
    reach = volume.room.radius
    own = body & (distance < CORE * reach)
    behind = (points[..., 0] < BEHIND * reach) & (points[..., 2] > -BELOW * distance)
    room = body & (distance > RIM * reach) & behind
    if not own.any() or not room.any():
        return body
    # Both grow until they have shared the body out.
    before = -1
    while (now := int(own.sum() + room.sum())) != before:
        before = now
        own = ndimage.binary_dilation(own, mask=body & ~room)
        room = ndimage.binary_dilation(room, mask=body & ~own, iterations=FASTER)
    return own


def subject_of(volume: Volume) -> Volume:
    """The volume with nothing in it but the subject."""
    kept = ndimage.binary_dilation(without_room(volume, body_at_centre(volume)), iterations=2)
    grid = volume.grid.copy()
    grid[~kept, 0] = np.minimum(grid[~kept, 0], math.log(math.expm1(1e-5)))
    return replace(volume, grid=grid)


def _points(volume: Volume) -> NDArray[np.float64]:
    axes = [volume.lower[a] + volume.voxel * np.arange(n) for a, n in enumerate(volume.grid.shape[:3])]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1)


def _distance(volume: Volume) -> NDArray[np.float64]:
    """(X, Y, Z) from the origin, units."""
    distance: NDArray[np.float64] = np.linalg.norm(_points(volume), axis=-1)
    return distance
