"""Cameras for stills and films of an asset: around the origin, up +z, front +x (docs/reference/conventions.md)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from facefolds_core.geometry.cameras import Camera

Point = tuple[float, float, float]
Sides = tuple[float, float]
"""Degrees to both sides: towards lower and higher azimuths or elevations."""

STEEPEST = 89.0
"""Degrees of elevation: straight up has no upright."""

SIDEWAYS, UP = 40.0, 18.0
"""Degrees to both sides, and up and down, of a flight."""


@dataclass(frozen=True)
class Eye:
    """Where one looks from, at the subject.

    Attributes:
        azimuth: degrees from the front to the subject's left (+y).
        elevation: degrees upwards.
        distance: from the target, in units (the capture's cameras are about 1 away).
        target: what is looked at.
    """

    azimuth: float = 0.0
    elevation: float = 0.0
    distance: float = 1.0
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)


def camera_of(eye: Eye, width: int, height: int, field_of_view: float) -> Camera:
    """An upright camera.

    Args:
        width, height: of the picture, pixels.
        field_of_view: degrees, of the picture's shorter side.
    """
    azimuth, elevation = math.radians(eye.azimuth), math.radians(float(np.clip(eye.elevation, -STEEPEST, STEEPEST)))
    outward = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    right = np.cross(-outward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(-outward, right), -outward])
    centre = np.array(eye.target) + eye.distance * outward
    focal = min(width, height) / (2 * math.tan(math.radians(field_of_view) / 2))
    K = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    return Camera("rendered", K, np.concatenate([rotation, -(rotation @ centre)[:, None]], 1), width, height)


def distance_to_fit(
    low: Point, high: Point, eyes: Sequence[Eye], width: int, height: int, field_of_view: float
) -> float:
    """The least distance from which a box is in the picture from all `eyes`, whose own distance does not count.

    Args:
        low, high: corners of the box, units.
        width, height, field_of_view: as of `camera_of`.
    """
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    half = math.tan(math.radians(field_of_view) / 2) / min(width, height) * np.array([width, height])
    least = 0.0
    for eye in eyes:
        seen = camera_of(replace(eye, distance=0.0), width, height, field_of_view)
        at = corners @ seen.rotation.T + seen.w2c[:, 3]  # z: behind the target, seen from the camera
        least = max(least, float((np.abs(at[:, :2]) / half - at[:, 2:]).max()))
    return least


def turntable(start: Eye, count: int, sides: Sides) -> list[Eye]:
    """From `start` to one side, to the other and back: the subject has a front only. Ends where it begins.

    Args:
        count: pictures.
        sides: degrees to the subject's right and left.
    """
    return [replace(start, azimuth=start.azimuth + _swing(phase, sides)) for phase in _phases(count)]


def fly_through(start: Eye, count: int, sides: Sides = (SIDEWAYS, SIDEWAYS), heights: Sides = (UP, UP)) -> list[Eye]:
    """A closed flight around `start`: to both sides, up and down, near and far, twice as often near as to one side.

    Args:
        sides: degrees to the subject's right and left.
        heights: degrees down and up.
    """
    return [
        replace(
            start,
            azimuth=start.azimuth + _swing(phase, sides),
            elevation=start.elevation + _swing(2 * phase, heights),
            distance=start.distance * (1 - 0.3 * (1 - math.cos(2 * phase)) / 2),
        )
        for phase in _phases(count)
    ]


def _phases(count: int) -> list[float]:
    return [2 * math.pi * index / count for index in range(count)]


def _swing(phase: float, sides: Sides) -> float:
    """Degrees: a sine whose negative half goes as far as the first of `sides`, the positive one as the second."""
    swing = math.sin(phase)
    return swing * sides[swing > 0]


def frame_due(index: int, rate: Fraction, sequence: Fraction, frames: int, first: int = 0) -> int:
    """The frame that a player shows with picture `index` of a film: the last one that has begun; the sequence repeats.

    Args:
        index: of the picture, from 0.
        rate: pictures a second, of the film.
        sequence: frames a second, of the asset.
        frames: of the asset.
        first: the frame that the film begins with.
    """
    return int(first + index * sequence / rate) % frames
