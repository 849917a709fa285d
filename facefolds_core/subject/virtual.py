"""Cameras that nobody filmed with: where they stand, how large they see the subject, and what they are asked for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import Delaunay

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.drawing import render
from facefolds_core.subject.splats import Splats

Array = NDArray[np.float64]

GAP = 15.0
"""Degrees, seen from the subject: gaps between cameras that are wider get a virtual one."""
VIEWS = 16
"""Virtual cameras, at most."""
FEW = 12
"""They are asked for places that fewer cameras see: what more cameras see, photos say better than Gaussians do."""
ABOVE = math.radians(10)
"""Of cameras farther than 90 degrees to both sides the hull reaches over the head."""
NEIGHBOURS = 0.5
"""Least cosine between cameras with a view halfway between them: farther apart, it lies above or below all others."""
HIDDEN = 0.01
"""What lies so far behind the subject's surface, units, a camera does not see."""
DIRECTIONS = 3000
"""Places that are tried, evenly on the sphere: 4 degrees apart."""
ALL_AROUND = 0.2
"""Length of the mean of the cameras' directions under which they stand all around: those of a half circle have 0.64."""
SMALLEST = 0.01
"""Least radius that a subject is taken to have, units."""
SOLID = 0.5
"""Opacity from which a pixel shows the subject."""
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


def seen_by_few(cameras: Sequence[Camera], real: Sequence[Camera], splats: Splats) -> NDArray[np.bool_]:
    """(V, H, W) pixels of virtual cameras whose place fewer than `FEW` real ones see; beside the subject that of the
    nearest pixel which shows it.

    Args:
        cameras: V of them, with pictures of one size.
        real: training cameras.
        splats: the subject.
    """
    surfaces = [render(splats, camera)[2] for camera in real] if cameras else []
    return np.array([_seen_by_few(camera, real, surfaces, splats) for camera in cameras])


def _seen_by_few(
    camera: Camera, real: Sequence[Camera], surfaces: Sequence[NDArray[np.float32]], splats: Splats
) -> NDArray[np.bool_]:
    """(H, W) of one; surfaces are the subject's depths in the real cameras."""
    _, opacity, depth = render(splats, camera)
    rows, columns = np.nonzero(opacity > SOLID)
    if not len(rows):
        return np.zeros(opacity.shape, bool)
    origins, directions = camera.rays(np.stack([columns, rows], -1).astype(np.float64) + 0.5)
    points = origins + directions * (depth[rows, columns] / (directions @ camera.rotation[2]))[:, None]
    count = np.zeros(opacity.shape, int)
    count[rows, columns] = sum(
        _sees(other, surface, points).astype(int) for other, surface in zip(real, surfaces, strict=True)
    )
    nearest = ndimage.distance_transform_edt(opacity <= SOLID, return_distances=False, return_indices=True)
    return np.asarray(count[tuple(nearest)] < FEW)


def _sees(camera: Camera, surface: NDArray[np.float32], points: Array) -> NDArray[np.bool_]:
    """(P,) whether a camera, whose depths (H, W) are given, sees points (P, 3)."""
    places, depth = camera.project(points)
    columns, rows = np.floor(places).clip(-1, [camera.width, camera.height]).astype(int).T
    inside = (depth > 0) & (columns >= 0) & (rows >= 0) & (columns < camera.width) & (rows < camera.height)
    inside[inside] = depth[inside] < surface[rows[inside], columns[inside]] + HIDDEN
    return np.asarray(inside)


def _places(real: Array) -> list[Array]:
    """Unit directions of the virtual cameras, given those of the real ones (C, 3)."""
    if len(real) < 3:
        return []
    tried = _sphere(DIRECTIONS)
    wanted = np.concatenate([tried[_between(tried, real)], _halfway(real)])
    nearest = (wanted @ real.T).max(1, initial=-1)
    chosen: list[Array] = []
    while len(chosen) < min(VIEWS, len(wanted)):
        farthest = int(nearest.argmin())
        if nearest[farthest] > math.cos(math.radians(GAP)):
            break
        chosen.append(wanted[farthest])
        nearest = np.maximum(nearest, wanted @ wanted[farthest])
    return chosen


def _between(tried: Array, real: Array) -> NDArray[np.bool_]:
    """(n,) which of the directions (n, 3) lie within the convex hull of the real ones (C, 3), seen from the subject:
    what Gaussians show beyond it was seen by nobody. The hull is that of a map that keeps angles to their mean
    direction. None lies far above the highest or below the lowest."""
    mean, heights, own = real.mean(0), np.arcsin(real[:, 2]), np.arcsin(tried[:, 2])
    level = (own >= heights.min() - ABOVE) & (own <= heights.max() + ABOVE)
    hull = Delaunay(_map(real, mean), qhull_options="QJ")
    return np.asarray(level & (hull.find_simplex(_map(tried, mean)) >= 0))


def _halfway(real: Array) -> Array:
    """(n, 3) directions in the middle between two real ones: cameras in a row have nothing else between them."""
    first, second = np.triu_indices(len(real), 1)
    near = (real[first] * real[second]).sum(1) > NEIGHBOURS
    middle = (real[first] + real[second])[near]
    return np.asarray(middle / np.linalg.norm(middle, axis=1, keepdims=True))


def _map(directions: Array, mean: Array) -> Array:
    """(n, 2) azimuthal equidistant map of unit vectors (n, 3) about a mean direction, radians."""
    axis = mean / max(float(np.linalg.norm(mean)), 1e-9)  # about any, where cameras stand evenly all around
    across = directions @ np.linalg.svd(axis[None])[2][1:].T
    length = np.linalg.norm(across, axis=1, keepdims=True)
    angles = np.arctan2(length, (directions @ axis)[:, None])
    return np.asarray(angles * across / np.maximum(length, 1e-9))


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
