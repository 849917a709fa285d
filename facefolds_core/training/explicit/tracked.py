"""What a tracked mesh says of the surfaces: whether it is to be believed, and where it lies."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.chart import Chart
from facefolds_core.params import StartParams
from facefolds_core.subject.outline import profile, whole_window, window_uv
from facefolds_core.subject.volume import Volume

Array = NDArray[np.float64]

REACH, FAR = 0.006, 0.03
"""Where the Gaussians lie outside a tracked mesh by more, units, they are believed: a mesh knows no hair. `FAR` where
fewer cameras look than `WELL_SEEN`: how far away things are is not known well there."""
WELL_SEEN = 0.95
"""Share of the training cameras."""
MAX_DISTANCE = 0.02
"""A direction in which mesh and Gaussians lie farther apart, units, is off."""
MAX_SHARE_OFF = 0.5
"""A mesh that is off in more than this share of the directions is left out."""
NODES = 128
"""Rows and columns of (u, v) at which mesh and Gaussians are compared."""
TRUST = 0.004
"""The mesh is kept where the opacity found lies nearer than this, units; farther offsets lose as much."""
MESH_FRAMES = 12
"""Frames of a tracked mesh that are looked at, at least: the mean of more is much the same, and each costs a cast."""
BORDER = 10
"""Nodes from the border inwards over which the mesh takes over from the volume."""
OPACITY = 0.9
"""At the start, where only the mesh has a surface."""


def some_frames(vertices: Array) -> Array:
    """Of vertices (K, V, 3), `MESH_FRAMES` to twice as many, evenly spread; all of fewer."""
    return vertices[:: max(1, len(vertices) // MESH_FRAMES)]


def trusted_surface(
    scene: Scene, volume: Volume, chart: Chart, start: StartParams
) -> tuple[tuple[NDArray[np.float32], NDArray[np.int32]] | None, tuple[Fact, ...]]:
    """The tracked mesh, or None where there is none or it is wrong; and what is to be said of it."""
    surface = scene.load_surface()
    if surface is None:
        return None, ()
    vertices = surface[0].astype(np.float64)
    share = share_off(volume, chart, vertices, surface[1], start)
    if share <= MAX_SHARE_OFF:
        return surface, ()
    return None, (fact("mesh_is_off", share=share, distance=MAX_DISTANCE),)


def share_off(volume: Volume, chart: Chart, vertices: Array, faces: NDArray[np.int32], start: StartParams) -> float:
    """Share of the directions, of those with a surface in the volume and in the mesh (K, V, 3), in which the two lie
    over MAX_DISTANCE apart; 0 where there are none. Nothing is compared behind the ears, where few cameras look."""
    u0, u1, v0, v1 = whole_window(chart, start)
    uv = window_uv((max(u0, -1.0), u1, max(v0, -1.0), min(v1, 1.0)), NODES, NODES)
    least = start.subject_opacity
    seen, mesh = profile(volume, chart, uv, least), mesh_radii(vertices, faces, chart, uv)
    apart = np.abs(seen.radius - mesh)[np.isfinite(mesh) & np.isfinite(seen.radius) & (seen.opacity >= least)]
    return float((apart > MAX_DISTANCE).mean()) if len(apart) else 0.0


def mesh_radii(vertices: Array, faces: NDArray[np.int32], chart: Chart, uv: Array) -> Array:
    """Radius (...) of the mesh's outermost point along the chart's rays of (u, v) (..., 2), mean over the frames of
    vertices (K, V, 3), units; NaN where no frame's mesh has a point on that ray."""
    origins, flat = (of(uv).reshape(-1, 3) for of in (chart.origins, chart.directions))
    total, count = np.zeros(len(flat)), np.zeros(len(flat))
    for frame in some_frames(vertices):
        mesh = trimesh.Trimesh(frame, faces, process=False)
        start = 2 * float(np.linalg.norm(frame - np.array(chart.centre), axis=1).max())
        points, ray, _ = mesh.ray.intersects_location(origins + start * flat, -flat, multiple_hits=False)
        radius = ((points - origins[ray]) * flat[ray]).sum(1)
        # A ray that meets nothing on this side runs on through its origin and may meet the back of a head.
        near = radius > 0
        total[ray[near]] += radius[near]
        count[ray[near]] += 1
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(uv.shape[:-1])


def blend(mesh: Array, volume: Array, reach: float | Array) -> tuple[Array, Array]:
    """Radii of the mesh where it is close to the volume, outside it or alone; of the volume elsewhere; a soft border.

    Args:
        mesh, volume: radii, units, NaN where there is none.
        reach: where the volume lies outside the mesh by more, units, it is believed; one number or (rows, columns).

    Returns:
        radii (NaN where neither has one), and the share of the mesh in them, 0 to 1.
    """
    close = np.isfinite(mesh) & ~(volume - mesh > reach)
    kept = np.clip(ndimage.distance_transform_edt(close) / BORDER, 0, 1)
    kept = np.where(np.isnan(volume), close.astype(np.float64), kept)
    filled = np.where(np.isnan(volume), mesh, volume)
    return np.where(
        kept > 0, kept * np.where(close, mesh, 0) + (1 - kept) * np.where(kept < 1, filled, 0), filled
    ), kept
