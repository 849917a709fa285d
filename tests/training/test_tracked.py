"""What a tracked mesh says of the surfaces."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import directions_to_uv
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit import tracked

PARAMS = ExplicitParams()
MESH = PARAMS.mesh


def test_mesh_is_kept_near_the_volume_and_left_far_from_it() -> None:
    mesh, volume = np.full((41, 41), 0.3), np.full((41, 41), 0.31)
    mesh[:, 30:] = np.nan
    volume[:, :10] = 0.3 + 2 * MESH.reach
    volume[20, 20] = np.nan
    radii, kept = tracked.blend(mesh, volume, MESH.reach)
    np.testing.assert_allclose(radii[:, :10], volume[:, :10])
    np.testing.assert_allclose(radii[:, 30:], 0.31)
    assert radii[20, 20] == 0.3
    deep = np.where(np.arange(41) == 20, 0.3 - 2 * MESH.reach, volume)
    np.testing.assert_array_equal(tracked.blend(mesh, deep, MESH.reach)[0][5, 20], 0.3)  # a hole of the volume
    assert radii[5, 20] == 0.3 and kept[5, 20] == 1 and kept[5, 5] == 0 and kept[5, 35] == 0


def test_a_mesh_has_no_radius_where_it_lies_behind_the_centre_only() -> None:
    ball = trimesh.creation.icosphere(3, 0.2)
    back = np.asarray(ball.vertices)
    faces = ball.faces[(back[ball.faces][..., 0] < 0.1).all(1)]  # the front is cut away
    directions = np.array([[1.0, 0, 0], [0.9, 0.3, 0], [0, 1, 0], [-1, 0, 0]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radii, _ = tracked.mesh_radii(back[None], faces, Chart((0, 0, 0)), directions_to_uv(directions))
    assert np.isnan(radii[:2]).all()
    assert radii[2:] == pytest.approx([0.2, 0.2], abs=0.003)


def test_a_mesh_that_breathes_has_the_deviation_of_its_radius() -> None:
    ball = trimesh.creation.icosphere(4, 1.0)
    frames = np.stack([radius * np.asarray(ball.vertices) for radius in (0.20, 0.22)])
    uv = np.array([[0.1, 0.2], [-0.3, 0.4]])
    mean, deviation = tracked.mesh_radii(frames, ball.faces, Chart((0, 0, 0)), uv)
    assert mean == pytest.approx([0.21, 0.21], abs=0.001)
    assert deviation == pytest.approx([0.01, 0.01], abs=1e-4)


def test_layers_on_a_mesh_reach_as_far_as_it_moves_and_hair_stands_out() -> None:
    still, nan = np.zeros(4), np.nan
    outside = np.array([0.0, 0.03, -0.05, nan])  # of the volume; deeper is a hole of it
    widths = tracked.mesh_halfwidth(outside, still, PARAMS, voxel=0.01)
    assert widths == pytest.approx(MESH.halfwidth + np.array([0, 0.02, 0, 0]))
    moving = tracked.mesh_halfwidth(np.zeros(1), np.array([0.005]), PARAMS, voxel=0.01)
    assert moving == pytest.approx([MESH.halfwidth + 0.01])
