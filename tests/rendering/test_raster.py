"""The compiled rasteriser against ray casting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import AssetCaster
from tests.assets import Meshes, grid_faces
from tests.scenes import look_at_origin


def bumpy(seed: int, n: int = 24) -> TexturedMesh:
    """A height field around the origin that hides parts of itself."""
    rng = np.random.default_rng(seed)
    t, s = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    points, st = np.stack([rng.uniform(-0.15, 0.15, s.shape), s - 0.5, 0.5 - t], -1), np.stack([s, t], -1)
    return TexturedMesh(points.reshape(-1, 3).astype(np.float32), grid_faces(n), st.reshape(-1, 2).astype(np.float32))


@pytest.mark.parametrize("angles", [(0, 0), (60, 30), (85, -5), (180, 0)])
def test_the_hits_are_those_of_the_rays(angles: tuple[float, float]) -> None:
    camera = look_at_origin("camera", *angles, 64)
    meshes = [bumpy(0), bumpy(1)]
    drawn, cast = cast_layers(camera, meshes), AssetCaster(Meshes(meshes)).cast(camera)
    assert drawn.hit.any()
    assert (drawn.hit != cast.hit).sum() <= 2  # seen: 0; rays that touch the silhouette are a matter of rounding
    both = drawn.hit & cast.hit
    assert np.abs(drawn.st - cast.st)[both].max() < 1e-4
    assert (drawn.st[~drawn.hit] == 0).all()


def test_a_mesh_that_reaches_behind_the_camera_is_still_hit_where_it_is_in_front() -> None:
    camera = look_at_origin("camera", 0, 0, 32)
    big = replace(bumpy(2, 3), vertices=(bumpy(2, 3).vertices * 20).astype(np.float32))
    tilted = replace(big, vertices=big.vertices[:, [2, 1, 0]] * np.float32([1, 1, 0.05]) - np.float32([0, 0, 0.3]))
    drawn, cast = cast_layers(camera, [tilted]), AssetCaster(Meshes([tilted])).cast(camera)
    assert tilted.vertices[:, 0].max() > 1.5  # the camera stands at x = 1
    assert drawn.hit.any()
    assert (drawn.hit != cast.hit).sum() <= 2


def test_triangles_seen_from_the_side_and_out_of_sight_are_not_drawn() -> None:
    camera = look_at_origin("camera", 0, 0, 32)
    flat = np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], np.float32)
    mesh = TexturedMesh(flat, np.array([[0, 1, 2]], np.int32), np.zeros((3, 2), np.float32))
    away = replace(mesh, vertices=bumpy(0).vertices[:3] + np.float32([5, 0, 0]))
    assert not cast_layers(camera, [mesh, away]).hit.any()
