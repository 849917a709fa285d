"""What a tracked mesh says: radii along a chart's rays, and where it rules."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.sphere_uv import directions_to_uv
from facefolds_core.training.explicit.tracked import FAR, REACH, blend, mesh_radii

AXIS = -0.2


def test_mesh_is_kept_near_the_volume_and_left_far_from_it() -> None:
    mesh, volume = np.full((41, 41), 0.3), np.full((41, 41), 0.3 + 0.5 * REACH)
    mesh[:, 30:] = np.nan
    volume[:, :10] = 0.3 + 2 * REACH
    volume[20, 20] = np.nan
    radii, kept = blend(mesh, volume, REACH)
    np.testing.assert_allclose(radii[:, :10], volume[:, :10])
    np.testing.assert_allclose(radii[:, 30:], 0.3 + 0.5 * REACH)
    assert radii[20, 20] == 0.3
    deep = np.where(np.arange(41) == 20, 0.3 - 2 * REACH, volume)
    np.testing.assert_array_equal(blend(mesh, deep, REACH)[0][5, 20], 0.3)  # a hole of the volume
    assert radii[5, 20] == 0.3 and kept[5, 20] == 1 and kept[5, 5] == 0 and kept[5, 35] == 0
    # Where few cameras look the mesh is believed farther from the volume.
    mesh, volume = np.full((41, 41), 0.3), np.full((41, 41), 0.3 + 2 * REACH)
    radii, kept = blend(mesh, volume, np.where(np.arange(41) < 20, FAR, REACH))
    assert radii[5, 5] == 0.3 and kept[5, 5] == 1
    assert radii[5, 35] == 0.3 + 2 * REACH and kept[5, 35] == 0


def test_a_mesh_has_no_radius_where_it_lies_behind_the_centre_only() -> None:
    ball = trimesh.creation.icosphere(3, 0.2)
    back = np.asarray(ball.vertices)
    faces = ball.faces[(back[ball.faces][..., 0] < 0.1).all(1)]  # the front is cut away
    directions = np.array([[1.0, 0, 0], [0.9, 0.3, 0], [0, 1, 0], [-1, 0, 0]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radii = mesh_radii(back[None], faces, Chart((0, 0, 0)), directions_to_uv(directions))
    assert np.isnan(radii[:2]).all()
    assert radii[2:] == pytest.approx([0.2, 0.2], abs=0.003)


def test_radii_of_a_mesh_below_the_belt_are_measured_from_the_axis() -> None:
    """A square pipe about the axis."""
    angles = np.radians([45, 135, 225, 315])
    ring = np.stack([AXIS + 0.1 * np.cos(angles), 0.1 * np.sin(angles)], -1)
    vertices = np.concatenate([np.insert(ring, 2, z, 1) for z in (-0.4, 0.0)])
    sides = np.arange(4)
    after = (sides + 1) % 4
    faces = np.concatenate([np.stack([sides, after, 4 + sides], 1), np.stack([after, 4 + after, 4 + sides], 1)])
    chart = Chart((AXIS, 0.0, 0.0), Belt(0.0, 0.25))
    uv = np.array([[-0.5, 0.0], [-0.5, 0.5], [-0.9, -1.0], [-1.3, 0.0], [0.5, 0.0]])
    radii = mesh_radii(vertices[None], faces.astype(np.int32), chart, uv)
    inner = 0.1 / math.sqrt(2)
    assert radii[:3] == pytest.approx([inner, 0.1, inner], abs=1e-6)
    assert np.isnan(radii[3:]).all()


def test_the_radius_is_the_mean_over_the_frames() -> None:
    ball = trimesh.creation.icosphere(4, 1.0)
    sizes = np.array([0.28, 0.30, 0.30, 0.36])
    uv = np.random.default_rng(0).uniform(-0.8, 0.8, (50, 2))
    radii = mesh_radii(sizes[:, None, None] * ball.vertices, ball.faces, Chart((0, 0, 0)), uv)
    assert radii == pytest.approx(np.full(50, sizes.mean()), abs=1e-3)
