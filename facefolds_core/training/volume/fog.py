"""A subject that the volume explains by fog: pale and smooth before a room that is as pale."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.facts import Fact, fact
from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.outline import thickness
from facefolds_core.training.volume.subject import EMPTY

Bool = NDArray[np.bool_]


def clear_of_fog(volume: Volume, params: ExplicitParams, notes: list[Fact]) -> Volume:
    """The volume; where the subject is fog in it, which `notes` say, a denser one whose holes are filled."""
    start = params.start
    depth = thickness(volume, start.subject_opacity)
    if depth <= start.fog_depth:
        return volume
    notes.append(fact("fog", depth=depth, over=start.fog_depth, gain=start.fog_gain))
    return filled(volume, params).denser(start.fog_gain)


def filled(volume: Volume, params: ExplicitParams) -> Volume:
    """With at least `body_depth` in holes of the subject and dents narrower than twice `fog_holes`: where what stands
    behind is as pale, nothing speaks for the subject, and it is taken for the room. `volume` itself if it has none."""
    least = params.subject.body_depth
    body = np.logaddexp(0, volume.grid[..., 0]) > least
    hole = closing(body, params.start.fog_holes / volume.voxel) & ~body
    if not hole.any():
        return volume
    grid = volume.grid.copy()
    removed = None if volume.removed is None else volume.removed.copy()
    if removed is not None:
        there = hole & (removed[..., 0] > grid[..., 0])
        grid[there] = removed[there]
        removed[hole, 0] = EMPTY
    grid[hole, 0] = np.maximum(grid[hole, 0], math.log(math.expm1(max(least, 1e-12))))
    return replace(volume, grid=grid, removed=removed)


def closing(body: Bool, radius: float) -> Bool:
    """Morphological closing of (X, Y, Z) by a ball, radius in voxels; what lies outside the grid is empty."""
    found = body.copy()
    if radius > 0 and body.any():
        (box,) = ndimage.find_objects(body.astype(np.int8))  # what is closed lies within the hull of what there is
        margin = math.ceil(radius) + 1
        apart = ndimage.distance_transform_edt(~np.pad(body[box], margin))
        closed = ndimage.distance_transform_edt(apart <= radius) > radius
        inner = slice(margin, -margin)
        found[box] |= closed[inner, inner, inner]
    return found
