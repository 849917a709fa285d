"""Embree against trying every triangle."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from facefolds_core.geometry.rays import MISS, EmbreeMesh, TriangleHits, hits_in, moeller_trumbore
from tests.assets import grid_faces


def brute_force_hits(
    vertices: np.ndarray, faces: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> TriangleHits:
    """Nearest hits by trying every triangle for every ray, in float64: the reference for `EmbreeMesh`."""
    triangles = np.asarray(vertices, np.float64)[faces]
    nearest = np.full(len(origins), MISS, np.int32)
    if len(triangles):
        t, u, v = moeller_trumbore(origins[:, None], directions[:, None], triangles)
        inside = (t > 0) & (u >= 0) & (v >= 0) & (u + v <= 1)
        nearest = np.where(inside.any(1), np.where(inside, t, np.inf).argmin(1), MISS).astype(np.int32)
    return hits_in(triangles, nearest, origins, directions)


def folded_sheet(rng: np.random.Generator, n: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A crumpled grid near the origin that rays along -x cross several times: vertices (V, 3) f32, faces (F, 3) i32."""
    a, b = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    x = 0.4 * np.sin(5 * a) + rng.normal(0, 0.05, a.shape)
    y = 0.3 * (a + 1.2 * np.sin(4 * a)) + rng.normal(0, 0.02, a.shape)
    vertices = np.stack([x, y, 0.3 * b], -1).reshape(-1, 3).astype(np.float32)
    return vertices, grid_faces(n)


def rays(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    origins = np.array([1.0, 0.1, -0.05]) + rng.normal(0, 0.05, (count, 3))
    targets = rng.uniform(-0.7, 0.7, (count, 3)) * [0.2, 1, 0.6]
    directions = targets - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_embree_finds_what_trying_every_triangle_finds() -> None:
    rng = np.random.default_rng(0)
    vertices, faces = folded_sheet(rng)
    origins, directions = rays(rng, 4000)
    fast = EmbreeMesh(vertices, faces).nearest(origins, directions)
    slow = brute_force_hits(vertices, faces, origins, directions)
    assert 0.3 < (slow.triangle != MISS).mean() < 0.95
    np.testing.assert_array_equal(fast.triangle, slow.triangle)
    np.testing.assert_array_equal(fast.barycentric, slow.barycentric)
    hit = slow.triangle != MISS
    points = np.einsum("rk,rkc->rc", slow.barycentric[hit], vertices[faces][slow.triangle[hit]].astype(float))
    off_ray = np.linalg.norm(np.cross(points - origins[hit], directions[hit]), axis=1)
    assert off_ray.max() < 1e-9  # float64: about 1e-15; float32 would give 1e-7
    beyond = brute_force_hits(vertices, faces, points + 1e-6 * directions[hit], directions[hit])
    assert (beyond.triangle != MISS).mean() > 0.2  # the sheet is folded: some rays cross it more than once


def test_no_ray_slips_through_shared_edges() -> None:
    rng = np.random.default_rng(2)
    n = 9
    y, z = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    vertices = np.stack([0.3 * y * z, y, z], -1).reshape(-1, 3).astype(np.float32)
    faces = grid_faces(n)
    ends = vertices[faces[: len(faces) // 2, 1:]].astype(float)  # the diagonals, which two triangles share
    share = rng.uniform(0, 1, (200, len(ends), 1))
    targets = (share * ends[:, 0] + (1 - share) * ends[:, 1]).reshape(-1, 3)
    origins = np.broadcast_to([1.1, 0.03, 0.02], targets.shape)
    assert (EmbreeMesh(vertices, faces).nearest(origins, targets - origins).triangle != MISS).all()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_both_sides_are_hit(side: float) -> None:
    """And nothing behind the camera."""
    vertices, faces = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32), np.array([[0, 1, 2]], np.int32)
    origins, directions = np.array([[side, 0.2, 0.3]]), np.array([[-side, 0.0, 0.0]])
    for nearest in (EmbreeMesh(vertices, faces).nearest, partial(brute_force_hits, vertices, faces)):
        np.testing.assert_allclose(nearest(origins, directions).barycentric, [[0.5, 0.2, 0.3]], atol=1e-12)
        assert nearest(origins, -directions).triangle[0] == MISS


def test_an_empty_mesh_is_not_hit() -> None:
    empty = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)
    found = EmbreeMesh(*empty).nearest(np.zeros((5, 3)), np.ones((5, 3)))
    assert (found.triangle == MISS).all()
    assert (found.barycentric == 0).all()


def test_a_triangle_seen_from_the_side_gives_finite_weights() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1e-7]], np.float32)
    faces = np.array([[0, 1, 2]], np.int32)
    origins = np.stack([np.full(100, 2.0), np.zeros(100), np.linspace(-1e-7, 1e-7, 100)], 1)
    directions = np.broadcast_to([-1.0, 0.0, 0.0], origins.shape)
    weights = EmbreeMesh(vertices, faces).nearest(origins, directions).barycentric
    assert np.isfinite(weights).all()
    assert (weights >= 0).all()
