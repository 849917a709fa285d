"""Decimation of Poisson surfaces, each by itself, to at most R^m x R^m vertices, and their texture coordinates.

Quadric edge collapse (Garland and Heckbert 1997) by fast_simplification with aggressiveness 3. Measured
(docs/research/export.md) against its default, which errs two to three times more, and pymeshlab's, which
with its border kept misses the bound on the vertices and errs more at the same number of triangles.
"""

from __future__ import annotations

from collections.abc import Sequence

import fast_simplification
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facefolds_core.asset.draco import degenerate_faces
from facefolds_core.errors import UserError
from facefolds_core.export.poisson import compact, largest_component
from facefolds_core.export.stores import Grids
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.meshes import Surface, TexturedMesh
from facefolds_core.geometry.sphere_uv import Window, texel_uv, uv_to_st
from facefolds_core.params import DecimateParams
from facefolds_core.progress import progress

AGGRESSIVENESS = (3, 5, 7)
"""Of the simplification, tried in turn until the target is reached."""


def decimate_layers(
    surfaces: Sequence[Surface], grids: Grids, resolution: int, params: DecimateParams
) -> list[TexturedMesh]:
    """Decimate all layers to at most resolution x resolution vertices and give them texture coordinates.

    Raises:
        UserError: if there are not as many surfaces as sampled layers, or nothing is left of a layer; names it.
    """
    if len(surfaces) != grids.num_layers:
        raise UserError(
            "surfaces and samples do not belong together",
            expected=f"{grids.num_layers} surfaces",
            found=len(surfaces),
            remedy="run `dvc repro`, which makes both again",
        )
    meshes = []
    for i, surface in enumerate(progress(surfaces, desc="decimation", unit="layer")):
        coarse = decimate(surface, resolution**2, grids.chart)
        if len(coarse.faces) == 0:
            raise UserError(
                "decimation left nothing of a layer",
                place=f"layer {i} (0 is the outermost), R^m {resolution}",
                expected="at least one triangle",
                found=f"{len(surface.faces)} triangles before, none after",
                remedy="raise this R^m where it stands: decimate.resolution or a level's "
                "mesh_resolution in compress.levels",
            )
        if params.uv == "exact":
            st = exact_st(coarse.vertices, grids.window(i), grids.chart)
        else:
            st = nearest_st(coarse.vertices, grids.points[i], grids.valid[i])
        meshes.append(TexturedMesh(coarse.vertices, coarse.faces, st))
    return meshes


def decimate(surface: Surface, max_vertices: int, chart: Chart) -> Surface:
    """Collapse edges until at most `max_vertices` vertices are left; drop faces that turned over or lost their area.

    Layers are level sets that the chart's rays meet once, so every face looks along them.
    """
    vertices, faces = surface.vertices.astype(np.float64), surface.faces.astype(np.intp)
    # Euler: an open sheet has F = 2 V - 2 - B triangles, B its border vertices, a few times sqrt(V) after decimation.
    for attempt in AGGRESSIVENESS:
        target = min(2 * max_vertices, len(surface.faces))
        while len(vertices) > max_vertices and target > 0:
            found, index = fast_simplification.simplify(
                surface.vertices, surface.faces, target_count=target, agg=attempt
            )
            kept = index[upright_faces(found, index, chart)].astype(np.intp)
            vertices, faces = compact(found.astype(np.float64), largest_component(kept, len(found)))
            target -= max(1, 2 * (len(vertices) - max_vertices))
    if len(vertices) > max_vertices:
        faces = faces[:0]
    return Surface(vertices.astype(np.float32), faces.astype(np.int32))


def upright_faces(vertices: NDArray[np.float32], faces: NDArray[np.int32], chart: Chart) -> NDArray[np.bool_]:
    """(F,) bool: faces that have an area and look along the chart's rays, outwards."""
    corners = vertices[faces].astype(np.float64)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    outward = (np.cross(a, b) * chart.outward(corners.mean(1))).sum(-1) > 0
    return np.asarray(outward & ~degenerate_faces(vertices, faces))


def nearest_st(
    vertices: NDArray[np.float32], points: NDArray[np.float32], valid: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Texture coordinates of the nearest valid sample (the paper's rule).

    Args:
        vertices: (V, 3).
        points, valid: (R, R, 3) and (R, R), the layer's samples.
    """
    r = len(points)
    st = uv_to_st(texel_uv(r, r))[valid]
    _, nearest = cKDTree(points[valid]).query(vertices)
    return np.asarray(st[nearest], np.float32)


def exact_st(vertices: NDArray[np.float32], window: Window, chart: Chart) -> NDArray[np.float32]:
    """Texture coordinates by their definition, the chart's; beyond the window they stop at its edge."""
    uv, _ = chart.uv(vertices.astype(np.float64))
    return np.asarray(uv_to_st(uv, window).clip(0, 1), np.float32)
