"""Sheets as meshes; whether neighbouring layers cross, by rays; and how many borders a surface has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from trimesh import Trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from facefolds_core.export.sheets import sheet_faces, sheet_mesh, vertex_uv
from facefolds_core.export.stores import Sheets
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.meshes import Surface, TexturedMesh

CROSSING_TOLERANCE = 1e-5
"""Two layers cross where the inner one is farther out by more than this, units: ray casting is in float32."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Order:
    """Neighbouring layers compared along the chart's rays through the vertices of both.

    Attributes:
        compared: vertices whose ray meets the other layer.
        crossed: those of the inner layer that lie beyond the outer one, and of the outer one that lie below the inner.
        deepest: by how much at most, units.
    """

    compared: int
    crossed: int
    deepest: float


def layer_order(meshes: Sequence[Surface], chart: Chart) -> Order:
    """Count the vertices of each layer that lie on the wrong side of a neighbouring layer."""
    compared, crossed, deepest = 0, 0, 0.0
    for outer, inner in pairwise(meshes):
        for beyond in (_heights(inner, outer, chart), -_heights(outer, inner, chart)):
            compared += len(beyond)
            crossed += int((beyond > CROSSING_TOLERANCE).sum())
            deepest = max(deepest, float(beyond.max(initial=0.0)))
    return Order(compared, crossed, deepest)


def _heights(mesh: Surface, other: Surface, chart: Chart) -> Array:
    """By how much the vertices of `mesh` lie farther out than `other`, of those whose ray meets it."""
    uv, radius = chart.uv(mesh.vertices.astype(np.float64))
    origins = chart.origins(uv)
    caster = RayMeshIntersector(Trimesh(other.vertices, other.faces, process=False))
    _, ray, points = caster.intersects_id(origins, chart.directions(uv), multiple_hits=False, return_locations=True)
    return np.asarray(radius[ray] - np.linalg.norm(points - origins[ray], axis=-1))


def boundary_loops(faces: NDArray[Any]) -> int:
    """Number of connected chains of boundary edges (edges of exactly one face) of a mesh (F, 3)."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    border = unique[count == 1]
    if len(border) == 0:
        return 0
    _, index = np.unique(border, return_inverse=True)
    index = index.reshape(-1, 2)
    size = int(index.max()) + 1
    links = coo_matrix((np.ones(len(index), np.int8), (index[:, 0], index[:, 1])), shape=(size, size))
    return int(connected_components(links, directed=False)[0])


def full_meshes(sheets: Sheets) -> list[TexturedMesh]:
    """All layers at the grid's resolution; no face where a sample is not valid."""
    faces, uv = sheet_faces(sheets), vertex_uv(sheets)
    return [
        sheet_mesh(sheets, layer, faces[known.reshape(-1)[faces].all(1)], uv)
        for layer, known in enumerate(sheets.valid)
    ]
