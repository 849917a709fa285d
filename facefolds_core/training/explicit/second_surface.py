"""A second surface beneath the first, where cameras see one: skin under a fringe, a nape under hair, a collar's inside.

A chart has one radius a direction, so what lies under an overhang has no place on layers about one middle. Points that
cameras see there say where a few layers more are needed, and how deep they lie. Elsewhere these have no surface at all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.subject.outline import nodes_at, shells, visible_points
from facefolds_core.subject.volume import Volume

Array = NDArray[np.float64]
Single = NDArray[np.float32]

LAYERS = 4
"""Of the second surface, where there is one."""
HALFWIDTH = 0.006
"""They lie within this distance of its middle, units."""
GAP = 0.001
"""Between the innermost layer of the first surface and the outermost of the second, at least, units."""
RAYS = 200_000
"""Of a camera that look for it, at most."""
MARGIN = 2.0
"""Voxels: what lies deeper beneath the innermost layer at a node, and at those around it, has no place on the first."""
WALL = 5
"""Nodes a side that are around one: a wall of the first surface, between high and low nodes, holds what lies there."""
LEAST_RADIUS = 0.04
"""What lies nearer to c is left out, units: rays of the chart crowd there."""
BLUR = 2.0
"""Standard deviation over which radii of points are averaged, nodes."""
CLOSE = 0.02
"""Of several surfaces beneath one another the outermost is taken, and what lies so near beneath it, units."""
LEAST_POINTS = 0.05
"""Points a node after blurring, at least: a single stray has 0.04 where it lies."""
LEAST_NODES = 60
"""Smaller patches are left out."""
AROUND = 3
"""Nodes by which the second surface goes on beneath the first, so that no seam is seen between them; more of them show
as floaters from the side."""


def second_surface(volume: Volume, chart: Chart, window: Window, inner: Array, cameras: Sequence[Camera]) -> Array:
    """Where cameras see something beneath all layers of the first surface.

    Args:
        volume: of the subject.
        inner: (rows, columns) radii of the innermost layer at the nodes over the window, units.

    Returns:
        (rows, columns) middle radii, units; 0 where there is none.
    """
    i, j, radius = _beneath(volume, chart, window, inner, cameras)
    outermost, _ = _smooth(inner.shape, i, j, radius, np.exp((radius - radius.max(initial=0.0)) / (CLOSE / 4)))
    near = radius > outermost[i, j] - CLOSE
    i, j, radius = i[near], j[near], radius[near]
    found, count = _smooth(inner.shape, i, j, radius, np.ones(len(radius)))
    known = large(count > LEAST_POINTS, LEAST_NODES)
    if not known.any():
        return np.zeros(inner.shape)
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    wide = ndimage.binary_dilation(known, iterations=AROUND)
    return np.where(wide, found[tuple(nearest)], 0.0)


def second_layers(middle: Array, inner: Array) -> Single:
    """(rows, columns, LAYERS) radii, outermost first, units, all of them beneath `inner`; 0 where there are none.

    Args:
        middle: of `second_surface`.
        inner: (rows, columns) radii of the innermost layer of the first surface.
    """
    top = np.minimum(middle, inner - GAP - HALFWIDTH)
    there = (middle > 0) & (top > LEAST_RADIUS - HALFWIDTH)
    return np.where(there[..., None], top[..., None] + HALFWIDTH * np.linspace(1, -1, LAYERS), 0.0).astype(np.float32)


def shells_of_both(volume: Volume, chart: Chart, uv: Array, radii: Array, first: int) -> tuple[Single, Single]:
    """`outline.shells` of each surface by itself.

    Args:
        uv: (..., 2).
        radii: (..., N), those of the second surface NaN where it has none.
        first: layers of the first surface.

    Returns:
        opacity (..., N), 0 where there is no surface, and rgb (..., N, 3).
    """
    opacity, rgb = np.zeros(radii.shape, np.float32), np.zeros((*radii.shape, 3), np.float32)
    opacity[..., :first], rgb[..., :first, :] = shells(volume, chart, uv, radii[..., :first])
    there = np.isfinite(radii[..., -1])
    if radii.shape[-1] > first and there.any():
        own = shells(volume, chart, uv[there], radii[there][:, first:])
        opacity[there, first:], rgb[there, first:] = own
    return opacity, rgb


def _beneath(
    volume: Volume, chart: Chart, window: Window, inner: Array, cameras: Sequence[Camera]
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Nodes (P,), (P,) and radii (P,) of the points that cameras see beneath the first surface."""
    uv, radius = chart.uv(visible_points(volume, list(cameras), RAYS))
    i, j, within = nodes_at(uv, window, inner.shape)
    lowest = ndimage.minimum_filter(inner, WALL, mode="nearest") - MARGIN * volume.voxel
    lost = within & (radius >= LEAST_RADIUS) & (radius < lowest[i, j])
    return i[lost], j[lost], radius[lost]


def _smooth(
    shape: tuple[int, ...], i: NDArray[np.intp], j: NDArray[np.intp], values: Array, weights: Array
) -> tuple[Array, Array]:
    """Means around the nodes of values (P,) at nodes (i, j), and the weights there."""
    total, count = np.zeros(shape), np.zeros(shape)
    np.add.at(total, (i, j), weights * values)
    np.add.at(count, (i, j), weights)
    total, count = (ndimage.gaussian_filter(part, BLUR, mode="nearest") for part in (total, count))
    return total / np.maximum(count, 1e-300), count


def large(known: NDArray[np.bool_], least: int) -> NDArray[np.bool_]:
    """Without the patches of fewer nodes than `least`."""
    labels, _ = ndimage.label(known, np.ones((3, 3)))
    return np.asarray(known & (np.bincount(labels.ravel()) >= least)[labels])
