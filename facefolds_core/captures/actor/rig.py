"""The actor's cameras: a calibrated rig about one metre from the head, in the capture's world (mm)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams

DISTANCE = 1000.0
TARGET = (0.0, -30.0, 0.0)
"""What the cameras look at, head frame, mm."""
_FIELD = (240.0, 366.0)
"""Width and height in mm at the head that fit into every picture."""
_MAX_AZIMUTH = 75.0
_ELEVATIONS = (-25.0, 35.0)
_FIRST_VIEW = (3.0, 2.0)
# (azimuth, elevation) at every twelfth place, the ones that `holdout: {every: 12}` takes: inside the rig.
_INNER_VIEWS = ((-17.0, 6.0), (40.0, 9.0), (-42.0, 4.0), (18.0, 14.0))
_INNER_EVERY = 12
_GOLDEN = (math.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class ActorRig:
    """Cameras in the order of their names.

    Attributes:
        cameras: all of one image size, continuous image coordinates, world mm.
    """

    cameras: tuple[Camera, ...]


def camera_at(name: str, azimuth: float, elevation: float, width: int, height: int) -> Camera:
    """A camera that looks at the head.

    Args:
        name: of the camera.
        azimuth: degrees to the head's left.
        elevation: degrees above the head.
        width, height: of its images, pixels.
    """
    a, e = math.radians(azimuth), math.radians(elevation)
    to_world = np.diag([1.0, -1.0, -1.0])
    away = to_world @ np.array([math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)])
    target = to_world @ np.array(TARGET) + np.array([0.0, 0.0, 1000.0])
    forward = -away
    right = np.cross(np.array([0.0, 1.0, 0.0]), forward)
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    centre = target + DISTANCE * away
    focal = DISTANCE * min(width / _FIELD[0], height / _FIELD[1])
    K = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    return Camera(name, K, np.concatenate([R, (-R @ centre)[:, None]], 1), width, height)


def make_rig(params: CaptureParams) -> ActorRig:
    """The rig of a capture: a nearly frontal camera, inner views at every twelfth place, the rest spread evenly.

    The rest walks from the head's right to its left in equal steps of azimuth, with elevations by the golden ratio:
    any number of cameras covers the window of directions without clusters.
    """
    inner = [place for place in range(1, params.cameras) if (place + 1) % _INNER_EVERY == 0]
    outer = [place for place in range(1, params.cameras) if place not in inner]
    views = {0: _FIRST_VIEW}
    views |= {place: _INNER_VIEWS[k % len(_INNER_VIEWS)] for k, place in enumerate(inner)}
    low, high = _ELEVATIONS
    for k, place in enumerate(outer):
        azimuth = _MAX_AZIMUTH * (2 * (k + 0.5) / len(outer) - 1)
        views[place] = (azimuth, low + (high - low) * ((0.5 + k * _GOLDEN) % 1.0))
    names = [f"A{place:03d}" for place in range(params.cameras)]
    return ActorRig(
        tuple(camera_at(name, *views[place], params.width, params.height) for place, name in enumerate(names))
    )
