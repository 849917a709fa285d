"""The tracked mesh: a fixed grid of rays from outside towards the head, cut with its opaque surface at every time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.captures.actor.motion import NOSE, pose_at
from facefolds_core.captures.actor.shape import trace
from facefolds_core.kernels.jit import kernel

Array = NDArray[np.float64]

ROWS, COLUMNS = 80, 72
_AZIMUTH = 105.0
"""The grid reaches this far to both sides, degrees: face, temples, ears' place, sides of the neck; not the nape."""
_ELEVATIONS = (84.0, -26.0)
_CENTRES = (20.0, -100.0)
"""y of the point that the rays aim at, mm: the upper value down to the horizon, then it slides into the neck."""
_STARTS = (300.0, 110.0)
"""Distance from that point at which the rays start, mm: the lowest start between chin and shoulders."""


@dataclass(frozen=True)
class TrackedMesh:
    """Constant topology: only `vertices` depend on the time.

    Attributes:
        vertices: (V, 3) float32, head frame, mm. Each lies on the surface that is outermost along its ray: skin,
            eyeball, or what shows between open lips; never hair.
        faces: (F, 3) int32, counter-clockwise from outside.
        uv: (V, 2) float32 in [0, 1]: u right as seen from the front, v up.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    uv: NDArray[np.float32]


@kernel(parallel=True)
def _cut(origins: Array, directions: Array, pose: Array, far: float) -> Array:
    """Distances (V,) along rays (V, 3), head mm, to the first crossing."""
    hits = np.empty(len(origins))
    for i in prange(len(origins)):
        o = (origins[i, 0], origins[i, 1], origins[i, 2])
        d = (directions[i, 0], directions[i, 1], directions[i, 2])
        hits[i] = trace(o, d, 0.0, far, pose)
    return hits


def _rays() -> tuple[Array, Array, NDArray[np.float32]]:
    """Origins (V, 3) outside the head, unit directions (V, 3) towards its axis, and uv (V, 2)."""
    t, s = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(0, 1, COLUMNS), indexing="ij")
    high, low = _ELEVATIONS
    elevation = np.radians(high + (low - high) * t)
    azimuth = np.radians(_AZIMUTH) * (2 * s - 1)
    below = np.clip(elevation / math.radians(low), 0, 1)
    centre_y = _CENTRES[0] + (_CENTRES[1] - _CENTRES[0]) * below
    flat = np.cos(elevation)
    out = np.stack([flat * np.sin(azimuth), np.sin(elevation), flat * np.cos(azimuth)], -1).reshape(-1, 3)
    centres = np.stack([np.zeros_like(centre_y), centre_y, np.full_like(centre_y, -15.0)], -1).reshape(-1, 3)
    uv = np.stack([s, 1 - t], -1).reshape(-1, 2).astype(np.float32)
    start = (_STARTS[0] + (_STARTS[1] - _STARTS[0]) * below).reshape(-1, 1)
    return centres + start * out, -out, uv


def _faces() -> NDArray[np.int32]:
    index = np.arange(ROWS * COLUMNS, dtype=np.int32).reshape(ROWS, COLUMNS)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2)
    return np.ascontiguousarray(triangles.reshape(-1, 3))


def tracked_mesh(time: float, nose: float = 0.0) -> TrackedMesh:
    """The mesh at a time in seconds. Vertices are within 0.2 mm of the rendered surface (but slide on the skin).

    Args:
        nose: mm by which the nose is longer. What is not the head, as the ball, is not tracked.
    """
    origins, directions, uv = _rays()
    pose = pose_at(time)
    pose[NOSE] = nose
    hits = _cut(origins, directions, pose, _STARTS[0])
    if not np.isfinite(hits).all():
        raise AssertionError("a ray of the tracked mesh misses the head")
    vertices = (origins + hits[:, None] * directions).astype(np.float32)
    return TrackedMesh(vertices, _faces(), uv)
