"""Where the subject faces, found from where the cameras stand: for captures without tracked mesh and `front`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.cameras import Camera

Array = NDArray[np.float64]

WELL_BESIDE = 60.0
"""Degrees: how far beside the front a camera still counts as one that faces the subject, in words only."""


def find_front(cameras: Sequence[Camera], centre: Array, file: object) -> tuple[Array, Array, Fact]:
    """Where the subject faces and its up (3,), from where the cameras stand, and a fact that says so.

    A rig has most of its cameras before the face, evenly to both sides: the front is the mean of the directions to the
    cameras, made level, since rigs have more room above the face than below. Up is the median of the cameras' ups:
    some may be turned on their sides.
    """
    towards = np.array([camera.centre - centre for camera in cameras])
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    up = _median_direction(np.array([-camera.rotation[1] for camera in cameras]))
    level = towards - (towards @ up)[:, None] * up
    facing = level.mean(0)
    size = float(np.linalg.norm(facing))
    if not size > 1e-6:
        raise UserError(
            "the cameras do not tell where the subject faces",
            file=str(file),
            place="front",
            remedy="set `front` of this subject in params.yaml to a camera that faces it, upright",
        )
    along = towards @ facing / size
    before = float((along > np.cos(np.radians(WELL_BESIDE))).mean())
    nearest = cameras[int(np.argmax(along))].name
    return facing, up, fact("front_found", camera=nearest, share=before)


def _median_direction(directions: Array) -> Array:
    """(3,) unit: the geometric median (Weiszfeld's iteration) of unit directions (n, 3)."""
    point = directions.mean(0)
    for _ in range(50):
        weights = 1 / np.maximum(np.linalg.norm(directions - point, axis=1), 1e-6)
        point = weights @ directions / weights.sum()
    return np.asarray(point / max(float(np.linalg.norm(point)), 1e-12))
