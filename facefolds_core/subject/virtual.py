"""Cameras that nobody filmed with: where they stand, and how large they see the subject."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.splats import Splats

Array = NDArray[np.float64]

GAP = 15.0
"""Degrees, seen from the subject: gaps between cameras that are wider get a virtual one."""
FEW, VIEWS = 16, 24
"""Up to so many cameras there are virtual ones, too, until there are so many in all: more photos than these say more
than Gaussians do (the actor with 22 lost 0.2 dB over any background by two virtual ones)."""
DIRECTIONS = 3000
"""Places that are tried, evenly on the sphere: 4 degrees apart."""
SLOPE = 0.2
"""Least cosine of the angle between a place and the cameras' mean direction."""
SMALLEST = 0.01
"""Least radius that a subject is taken to have, units."""
QUANTILE = 0.01
"""Share of the Gaussians on each side that the subject's box leaves out."""


def virtual_cameras(real: Sequence[Camera], splats: Splats, size: tuple[int, int]) -> tuple[Camera, ...]:
    """Cameras between the real ones, each where the nearest other one is farthest, upright and aimed at the subject; as
    far away as the real ones, and with the pixels of the median one unless the subject is larger than that.

    Args:
        real: training cameras, in the head's own frame.
        splats: the subject.
        size: width and height of the pictures.
    """
    low, high = (edge.astype(np.float64) for edge in np.quantile(splats.means, [QUANTILE, 1 - QUANTILE], axis=0))
    middle, radius = 0.5 * (low + high), max(0.5 * float(np.linalg.norm(high - low)), SMALLEST)
    offsets = np.array([camera.centre - middle for camera in real])
    away = float(np.median(np.linalg.norm(offsets, axis=1)))
    focal = float(np.median([camera.K[0, 0] / np.linalg.norm(o) for camera, o in zip(real, offsets, strict=True)]))
    focal = min(focal * away, 0.5 * min(size) * math.sqrt(max(away**2 - radius**2, 1e-6)) / radius)
    K = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1]])
    places = _places(offsets / np.linalg.norm(offsets, axis=1, keepdims=True))
    return tuple(_aimed(f"virtual {n}", middle + away * d, middle, K, size) for n, d in enumerate(places))


def _places(real: Array) -> list[Array]:
    """Unit directions of the virtual cameras, given those of the real ones (C, 3)."""
    if not 3 <= len(real) <= FEW:
        return []
    tried = _sphere(DIRECTIONS)
    wanted = tried[_between(tried, real)]
    nearest = (wanted @ real.T).max(1, initial=-1)
    chosen: list[Array] = []
    while len(chosen) < min(VIEWS - len(real), len(wanted)):
        farthest = int(nearest.argmin())
        if nearest[farthest] > math.cos(math.radians(GAP)):
            break
        chosen.append(wanted[farthest])
        nearest = np.maximum(nearest, wanted @ wanted[farthest])
    return chosen


def _between(tried: Array, real: Array) -> NDArray[np.bool_]:
    """(n,) which of the directions (n, 3) lie within the convex hull of the real ones (C, 3), seen from the subject:
    what Gaussians show beyond it was seen by nobody. The hull is that of their central projection."""
    mean = real.mean(0) / max(float(np.linalg.norm(real.mean(0))), 1e-9)
    across = np.linalg.svd(mean[None])[2][1:]
    before, ahead = real @ mean, tried @ mean
    if before.min() < SLOPE:  # all around
        return np.asarray(ahead >= SLOPE)
    hull = Delaunay((real @ across.T) / before[:, None], qhull_options="QJ")
    places = (tried @ across.T) / np.maximum(ahead, SLOPE)[:, None]
    return np.asarray((ahead >= SLOPE) & (hull.find_simplex(places) >= 0))


def _sphere(count: int) -> Array:
    """(count, 3) unit vectors, evenly spread (a Fibonacci lattice)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (3 - math.sqrt(5)) * np.arange(count)
    flat = np.sqrt(1 - z**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], -1)


def _aimed(name: str, centre: Array, target: Array, K: Array, size: tuple[int, int]) -> Camera:
    """Upright: the picture's down is the world's -z, as far as the view allows."""
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(forward, np.array([0.0, 0.0, 1.0]))
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([0.0, 1.0, 0.0])
    R = np.array([right, np.cross(forward, right), forward])
    return Camera(name, K, np.hstack([R, -(R @ centre)[:, None]]), *size)
