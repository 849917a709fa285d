"""Surfaces at a distance from another, along its normals: level sets of the signed distance, as radii of a chart.

Radii that differ by a constant crowd on a wall, as under a chin, and say nothing of where the wall stands. Level sets
are as far apart there as elsewhere, and still nested. Those of the mean distance from the surfaces of several frames
have their walls between the frames' walls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.subject.outline import MIN_RADIUS, node_positions, window_uv
from facefolds_core.training.explicit.second_surface import large

Array = NDArray[np.float64]
Single = NDArray[np.float32]

SAMPLES = 48
"""Of a ray, at which its distances are known."""
AROUND = 12
"""Nodes: a ray is followed as far as the surface goes within so many, for it may run beside a wall."""
POINTS = 0.5
"""Voxels between points on a surface."""
MOST_POINTS = 60
"""Along a side of a cell, at most: of a wall of 60 voxels in one cell the rest is between points."""
BLUR = 1.0
"""Standard deviation by which distances are smoothed, voxels: layers must be as smooth as the surface."""
MOVED_MARGIN = 4
"""Nodes around what moves that move with it."""
LEAST_MOVED = 30
"""Nodes of a patch that moves, at least: fewer are strays in one frame, which would be shown as spikes in all."""
LEAST_GAP = 1e-6
"""Between layers that would touch, units."""


@dataclass(frozen=True)
class Offsets:
    """Distances from a surface along each ray of a chart.

    Attributes:
        radii: (rows, columns, SAMPLES) of the samples, falling, units.
        distances: the same of their distances from the surface, falling from outside inwards, units.
    """

    radii: Array
    distances: Array

    def radius(self, distance: Array) -> Array:
        """Distances (rows, columns) -> radii of the outermost points that are no farther outside."""
        return _between(self.distances, self.radii, distance)

    def distance(self, radius: Array) -> Array:
        """Radii (rows, columns) -> distances; NaN stays."""
        return np.where(np.isnan(radius), np.nan, _between(self.radii, self.distances, np.nan_to_num(radius)))

    def through(self, surface: Array, found: Array, most: float) -> Offsets:
        """These, but that rays meet distance 0 where a surface lies (rows, columns), and not where it was `found`: on
        the grid that was smoothed. What differs by more than `most` is a wall that stands a node aside, and stays."""
        off = surface - found
        return Offsets(self.radii + np.where(np.abs(off) <= most, off, 0.0)[..., None], self.distances)

    def layers(self, distances: Array) -> Array:
        """Distances (rows, columns, N), falling -> radii, falling, none of them under `MIN_RADIUS`."""
        count = distances.shape[-1]
        radii = np.stack([self.radius(distances[..., k]) for k in range(count)], -1)
        return np.asarray(np.maximum(radii, MIN_RADIUS) + LEAST_GAP * np.arange(count)[::-1])


def offsets(chart: Chart, window: Window, surfaces: Sequence[Array], far: float, voxel: float) -> list[Offsets]:
    """From each of some surfaces, on the same samples.

    Args:
        surfaces: (rows, columns) radii at the nodes over the window.
        far: distances are wanted as far as this, units.
        voxel: of the grid on which they are found, units.
    """
    size = 2 * AROUND + 1
    high = np.max([ndimage.maximum_filter(s, size, mode="nearest") for s in surfaces], 0) + far
    low = np.min([ndimage.minimum_filter(s, size, mode="nearest") for s in surfaces], 0) - far
    radii = np.maximum(high[..., None] + (low - high)[..., None] * np.linspace(0, 1, SAMPLES), 1e-3)
    uv = window_uv(window, *radii.shape[:2])
    places = chart.points(np.repeat(uv[:, :, None], SAMPLES, 2), radii)
    ends = [chart.points(uv, s).reshape(-1, 3) for s in surfaces]
    low_corner = np.min(ends, (0, 1)) - far
    shape = tuple(int(n) for n in np.ceil((np.max(ends, (0, 1)) + far - low_corner) / voxel) + 1)
    positions = np.moveaxis((places - low_corner) / voxel, -1, 0)
    found = []
    for surface in surfaces:
        grid = ndimage.gaussian_filter(distance_grid(chart, window, surface, low_corner, shape, voxel), BLUR)
        along = ndimage.map_coordinates(grid, positions, order=1, mode="nearest").astype(np.float64)
        falling = np.minimum.accumulate(along, -1) - 1e-7 * np.arange(SAMPLES)
        found.append(Offsets(radii, falling))
    return found


def distance_grid(
    chart: Chart, window: Window, surface: Array, low: Array, shape: tuple[int, ...], voxel: float
) -> Single:
    """Signed distances of a grid's voxels from a surface, units, negative within it.

    Each voxel looks at the mean of the surface's points in the nearest voxel that has some, and at their normal: beside
    it the distance is that of the plane, farther off that of the point.
    """
    points, normals = _points_on(chart, window, surface, POINTS * voxel)
    at = np.rint((points - low) / voxel).astype(int)
    flat = np.ravel_multi_index(tuple(at.clip(0, np.array(shape) - 1).T), shape)
    count = np.bincount(flat, minlength=int(np.prod(shape)))
    sums = [np.bincount(flat, part, len(count)) for part in (*points.T, *normals.T)]
    means = (np.stack(sums, -1) / np.maximum(count, 1)[:, None]).astype(np.float32).reshape(*shape, 6)
    nearest = ndimage.distance_transform_edt(count.reshape(shape) == 0, return_distances=False, return_indices=True)
    point, normal = np.split(means[tuple(nearest)], 2, -1)
    normal /= np.maximum(_length(normal), 1e-6)[..., None]
    voxels = (low + voxel * np.moveaxis(np.indices(shape), 0, -1)).astype(np.float32)
    away = voxels - point
    along, square = (away * normal).sum(-1), (away**2).sum(-1)
    aside = np.maximum(square - along**2 - voxel**2, 0)
    uv, radius = chart.uv(voxels)
    nodes = node_positions(uv, window, surface.shape)
    outside = radius - ndimage.map_coordinates(surface, nodes, order=1, mode="nearest")
    side = np.where(square < voxel**2, along, outside)
    return np.asarray(np.copysign(np.sqrt(along**2 + aside), side), np.float32)


def _points_on(chart: Chart, window: Window, surface: Array, spacing: float) -> tuple[Array, Array]:
    """(P, 3) points on the cells of a map of radii, at most so far apart, and (P, 3) unit normals, outwards."""
    nodes = chart.points(window_uv(window, *surface.shape), surface)
    corners = nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, :-1], nodes[1:, 1:]
    a, b, c, d = corners
    sides = (np.maximum(_length(p), _length(q)) for p, q in ((c - a, d - b), (b - a, d - c)))
    rows, columns = (np.clip(np.ceil(side / spacing), 1, MOST_POINTS).astype(int) for side in sides)
    points, normals = [], []
    for m, n in np.unique(np.stack([rows, columns], -1).reshape(-1, 2), axis=0):
        a, b, c, d = (corner[(rows == m) & (columns == n)][:, None] for corner in corners)
        s, t = (np.indices((m, n)).reshape(2, -1, 1) + 0.5) / np.array([m, n])[:, None, None]
        points.append(((a * (1 - t) + b * t) * (1 - s) + (c * (1 - t) + d * t) * s).reshape(-1, 3))
        across, down = (b - a) * (1 - s) + (d - c) * s, (c - a) * (1 - t) + (d - b) * t
        normals.append(np.cross(down, across).reshape(-1, 3))
    normal = np.concatenate(normals)
    return np.concatenate(points), normal / np.maximum(_length(normal), 1e-12)[:, None]


def _length(vectors: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def over_frames(surface: Offsets, frames: Sequence[tuple[Array, Offsets]], halfwidth: Array) -> tuple[Offsets, Array]:
    """Distances from a surface, and where it lies elsewhere in some frames their mean.

    Args:
        surface: of the layers in the first of the frames.
        frames: (rows, columns) radii, NaN where nothing is known, and offsets from them.
        halfwidth: (rows, columns) of the layers, units: by more than this a frame must differ from the first.

    Returns:
        the offsets, and how much farther than a halfwidth layers must reach to hold all frames, (rows, columns).
    """
    (start, first), *others = frames
    changes = [np.zeros_like(first.distances)]
    for radii, theirs in others:
        apart = np.fmax(np.abs(first.distance(radii)), np.abs(theirs.distance(np.where(np.isnan(radii), radii, start))))
        moved = ndimage.binary_dilation(large(np.nan_to_num(apart) > halfwidth, LEAST_MOVED), iterations=MOVED_MARGIN)
        share = ndimage.gaussian_filter(moved.astype(np.float64), MOVED_MARGIN / 2)
        changes.append(share[..., None] * (theirs.distances - first.distances))
    mean = np.mean(changes, 0)
    if not mean.any():
        return surface, np.zeros_like(halfwidth)
    apart = np.max([np.abs(change - mean) for change in changes], 0)
    found = Offsets(surface.radii, np.minimum.accumulate(surface.distances + mean, -1))
    middle = found.radius(np.zeros_like(halfwidth))
    reach = ndimage.maximum_filter(_between(surface.radii, apart, middle), MOVED_MARGIN + 1, mode="nearest")
    return found, np.asarray(ndimage.gaussian_filter(reach, MOVED_MARGIN / 2, mode="nearest"))


def _between(x: Array, y: Array, at: Array) -> Array:
    """y where x, (..., n) and falling, is `at`, (...); beyond its ends y's ends."""
    k = np.clip((x > at[..., None]).sum(-1), 1, x.shape[-1] - 1)[..., None]
    (xa, xb), (ya, yb) = ([np.take_along_axis(of, k - back, -1)[..., 0] for back in (1, 0)] for of in (x, y))
    share = np.clip((xa - at) / np.maximum(xa - xb, 1e-12), 0, 1)
    return np.asarray(ya + (yb - ya) * share)
