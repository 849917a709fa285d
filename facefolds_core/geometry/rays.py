"""Nearest hit of rays with a triangle mesh, by Embree.

Two-sided (no culling). Embree works in float32 and only says which triangle is hit; where in the triangle is computed
again in float64 (Moeller and Trumbore 1997).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

MISS = -1


@dataclass(frozen=True)
class TriangleHits:
    """Nearest hits of R rays with one mesh.

    Attributes:
        triangle: (R,) int32, MISS where nothing is hit.
        barycentric: (R, 3) float64, weights of the triangle's three vertices; 0 where nothing is hit.
    """

    triangle: Indices
    barycentric: Array


def moeller_trumbore(origins: Array, directions: Array, triangles: Array) -> tuple[Array, Array, Array]:
    """Ray parameter t and coordinates (u, v) of rays in the planes of triangles: o + t d = (1-u-v) a + u b + v c.

    Args:
        origins, directions: (..., 3).
        triangles: (..., 3, 3), vertices by rows.

    Returns:
        t, u and v (...); infinite or NaN where a ray is parallel to the plane or a triangle has no area.
    """
    a = triangles[..., 0, :]
    edge1, edge2 = triangles[..., 1, :] - a, triangles[..., 2, :] - a
    p = np.cross(directions, edge2)
    offset = origins - a
    q = np.cross(offset, edge1)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / (edge1 * p).sum(-1)
        return (edge2 * q).sum(-1) * inverse, (offset * p).sum(-1) * inverse, (directions * q).sum(-1) * inverse


class EmbreeMesh:
    """A mesh in an Embree scene of its own.

    Args:
        vertices: (V, 3).
        faces: (F, 3) indices.
    """

    def __init__(self, vertices: NDArray[np.float32], faces: Indices) -> None:
        self.triangles: Array = np.asarray(vertices, np.float64)[faces]
        # robust: no ray slips through between two triangles that share an edge.
        self._scene = EmbreeScene(robust=True)
        if len(faces):
            TriangleMesh(self._scene, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int32))

    def first(self, origins: Array, directions: Array) -> Indices:
        """(R,) the triangles that rays hit first, MISS where none; origins, directions: (R, 3)."""
        if not len(self.triangles):
            return np.full(len(origins), MISS, np.int32)
        rays = (np.ascontiguousarray(of, np.float32) for of in (origins, directions))
        return np.asarray(self._scene.run(*rays), np.int32)

    def nearest(self, origins: Array, directions: Array) -> TriangleHits:
        """Nearest hits of rays; origins, directions: (R, 3)."""
        return hits_in(self.triangles, self.first(origins, directions), origins, directions)


def hits_in(triangles: Array, triangle: Indices, origins: Array, directions: Array) -> TriangleHits:
    """Where in the triangles that they hit (R,) rays (R, 3) pass."""
    barycentric = np.zeros((len(origins), 3))
    hit = triangle != MISS
    _, u, v = moeller_trumbore(origins[hit], directions[hit], triangles[triangle[hit]])
    # What float32 calls a hit may lie a hair outside in float64, or anywhere in a triangle seen exactly from the side.
    u = np.clip(np.nan_to_num(u, posinf=1, neginf=0), 0, 1)
    v = np.clip(np.nan_to_num(v, posinf=1, neginf=0), 0, 1 - u)
    barycentric[hit] = np.stack([1 - u - v, u, v], -1)
    return TriangleHits(triangle, barycentric)
