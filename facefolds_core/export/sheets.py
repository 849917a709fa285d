"""Nested sheets: all layers as radii on one grid of a chart's (u, v), and as meshes that share one triangulation.

Over each (u, v) of a chart a layer has one radius. So a mesh of a layer is a triangulation of the window with a radius
at each vertex, and one triangulation serves all layers.

*Nested by construction.* Let d = sum_k a_k d_k, a_k >= 0, be a direction inside the cone of a triangle with vertices
rho_k d_k. It meets the triangle's plane at the distance t with t d = sum_k b_k rho_k d_k, sum b_k = 1, that is
1/t = sum_k a_k / rho_k. This grows when any rho_k falls: if no vertex of a layer lies farther out than that of the
layer around it, then no point of it does. (Below a belt rays have different origins, and this holds for points of equal
shares b only: a layer's point is the outer layer's, moved by sum_k b_k (rho_k - rho'_k) d_k, against the rays.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from facefolds_core.export.stores import Grids, Sheets
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import ALL_AROUND, st_to_uv, texel_uv, uv_to_st

Array = NDArray[np.float64]


def grid_sheets(grids: Grids, resolution: int | None) -> Sheets:
    """The samples themselves as vertices.

    Where a layer has no point its radius is that of the nearest direction in which it has one; no face of it lies
    there. A sample beyond the layer around it is moved onto it. Each cell's diagonal joins the two corners whose radii,
    over all layers, differ less: along a jump of the radius, not across it. Where the window goes all around, its first
    and its last column lie on its borders, behind the head, at one place.

    Args:
        grids: with one window for all layers.
        resolution: samples a side, about; None keeps all.
    """
    step = 1 if resolution is None else max(1, round(grids.resolution / resolution))
    along = slice((grids.resolution - 1) % step // 2, None, step)
    thin = (slice(None), along, along)
    valid = grids.valid[thin]
    _, radii = grids.chart.uv(grids.points[thin].astype(np.float64))
    for layer, known in enumerate(valid):
        nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
        radii[layer] = radii[layer][tuple(nearest)]
    window = grids.window(0)
    st = uv_to_st(texel_uv(grids.resolution, grids.resolution, window), window)[thin[1:]]
    if window[3] - window[2] >= ALL_AROUND:
        # Both borders are one line: they meet there, where one alone knows a radius at that one.
        st[:, 0, 0], st[:, -1, 0] = 0, 1
        ends = valid[:, :, [0, -1]]
        weights = np.where(ends.any(-1, keepdims=True), ends, True)
        radii[:, :, [0, -1]] = ((radii[:, :, [0, -1]] * weights).sum(-1) / weights.sum(-1))[..., None]
    radii = np.minimum.accumulate(radii, 0)
    falling = np.abs(radii[:, :-1, :-1] - radii[:, 1:, 1:]).sum(0) <= np.abs(radii[:, :-1, 1:] - radii[:, 1:, :-1]).sum(
        0
    )
    return Sheets(st, radii.astype(np.float32), valid, grids.opacity[thin], falling, grids.windows[0], grids.chart)


def vertex_uv(sheets: Sheets) -> Array:
    """(n n, 2) (u, v) of the grid's vertices."""
    u0, u1, v0, v1 = (float(x) for x in sheets.window)
    return np.asarray(st_to_uv(sheets.st.reshape(-1, 2), (u0, u1, v0, v1)))


def sheet_faces(sheets: Sheets) -> NDArray[np.int64]:
    """(2 (n - 1)^2, 3) faces over the grid's vertices, row by row; counter-clockwise seen from outside."""
    n = len(sheets.st)
    index = np.arange(n * n, dtype=np.int64).reshape(n, n)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    falling = sheets.falling[..., None]
    first = np.where(falling, np.stack([a, c, d], -1), np.stack([a, c, b], -1))
    second = np.where(falling, np.stack([a, d, b], -1), np.stack([b, c, d], -1))
    return np.stack([first, second], 2).reshape(-1, 3)


def sheet_mesh(sheets: Sheets, layer: int, faces: NDArray[np.int64], uv: Array) -> TexturedMesh:
    """Mesh of one layer from faces over the grid's vertices; vertices that no face uses are dropped.

    Args:
        faces: (F, 3).
        uv: of `vertex_uv`.
    """
    used, index = np.unique(faces, return_inverse=True)
    radii = sheets.radii[layer].reshape(-1)[used].astype(np.float64)
    vertices = sheets.chart.points(uv[used], radii)
    st = sheets.st.reshape(-1, 2)[used].astype(np.float32)
    return TexturedMesh(vertices.astype(np.float32), index.reshape(-1, 3).astype(np.int32), st)
