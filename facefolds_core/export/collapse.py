"""Decimation of nested sheets: one triangulation of at most R^m x R^m vertices for all layers.

Edges collapse in the order of the quadric error (`collapse_kernel`), summed over layers. It measures the distance from
the surface and the shift of the texture together, in units of length, weighted by how much a place shows. Layers stay
nested (see `sheets`), vertices keep the directions and texture coordinates of samples, and the window's border stays
straight. Then each layer's radii at the vertices are fitted to all samples (`refit`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.export.collapse_kernel import build_quadrics, collapse
from facefolds_core.export.refit import refit_radii
from facefolds_core.export.sheets import Array, sheet_faces, sheet_mesh, vertex_uv
from facefolds_core.export.stores import Sheets
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.rendering.compositing import transmittance_before

MEASURED_LAYERS = 3
"""Layers that the error is measured on."""

MIN_VISIBILITY = 0.05
"""Least share of its opacity that a place counts with, however much lies before it."""

EMPTY_WEIGHT = 0.001
"""Weight of a place without opacity."""

MIN_AREA = 0.001
"""Least area of a triangle, as a share of half a grid cell."""


def decimated_ladder(sheets: Sheets, counts: Sequence[int]) -> dict[int, list[TexturedMesh]]:
    """Number of vertices -> meshes of all layers, outermost first, over one triangulation; one sequence of collapses.

    Triangles that hold nothing stay: the nearest hit of a layer counts, so that through a hole in the front of a head
    the back of that layer would be drawn over all others. `asset.cropping` leaves out those that hide nothing.
    """
    st, uv, faces = sheets.st.reshape(-1, 2), vertex_uv(sheets), sheet_faces(sheets)
    groups = np.array_split(np.arange(sheets.num_layers), min(MEASURED_LAYERS, sheets.num_layers))
    shows = contribution(sheets.opacity)
    weights = np.stack([shows[group].sum(0).reshape(-1) for group in groups], -1)
    points = np.stack([_positions(sheets, int(group[len(group) // 2]), uv) for group in groups], 1)
    quadrics = build_quadrics(points, faces, weights[faces].max(1) + EMPTY_WEIGHT)
    cell = (st.max(0) - st.min(0)).prod() / (len(sheets.st) - 1) ** 2
    targets = sorted(set(counts), reverse=True)
    borders = _borders(len(sheets.st))
    left = collapse(st, sheets.chart.unrolled(uv), borders, points, faces, quadrics, np.array(targets), MIN_AREA * cell)
    meshes = {}
    for target, corners in zip(targets, left, strict=True):
        used = corners[corners[:, 0] >= 0]
        fitted = refit_radii(sheets, shows, used, uv)
        meshes[target] = [sheet_mesh(fitted, layer, used, uv) for layer in range(sheets.num_layers)]
    return meshes


def contribution(opacity: NDArray[np.uint8]) -> Array:
    """(N, n, n) compositing weights of the layers seen along the rays, at least `MIN_VISIBILITY` times the opacity."""
    alpha = opacity / 255.0
    return np.asarray(alpha * np.maximum(transmittance_before(alpha, 0), MIN_VISIBILITY))


def _positions(sheets: Sheets, layer: int, uv: Array) -> Array:
    """(n n, 5): a layer's points relative to c, and texture coordinates as lengths on a sphere of its median radius."""
    radii = sheets.radii[layer].reshape(-1).astype(np.float64)
    u0, u1, v0, v1 = sheets.window
    scale = np.median(radii) * math.pi / 2 * np.array([v1 - v0, u1 - u0])
    points = sheets.chart.points(uv, radii) - np.array(sheets.chart.centre)
    return np.concatenate([points, sheets.st.reshape(-1, 2) * scale], -1)


def _borders(n: int) -> NDArray[np.uint8]:
    """(n n,) bits of the grid's four borders that each vertex lies on."""
    borders = np.zeros((n, n), np.uint8)
    borders[0] |= 1
    borders[-1] |= 2
    borders[:, 0] |= 4
    borders[:, -1] |= 8
    return borders.reshape(-1)
