"""Surfaces at a distance from another: closed forms, the true distance from a wall, frames that differ."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.subject.outline import MIN_RADIUS, window_uv
from facefolds_core.training.explicit.offsets import Offsets, offsets, over_frames
from tests.assets import grid_faces

Array = NDArray[np.float64]

CHARTS = [Chart((-0.1, 0.0, 0.0)), Chart((-0.1, 0.0, 0.0), Belt(0.2, 0.12))]
WINDOW = (-0.8, 0.8, -0.9, 0.9)
VOXEL, FAR = 0.003, 0.02
SHAPE = (80, 80)


def step(row: int) -> Array:
    """A chin at 0.15 above a row, a neck at 0.1 below it."""
    return np.where(np.arange(SHAPE[0])[:, None] < row, 0.15, 0.1) * np.ones(SHAPE)


def of(*surfaces: Array) -> list[Offsets]:
    return offsets(CHARTS[0], WINDOW, surfaces, FAR, VOXEL)


@pytest.mark.parametrize("distance", [-0.015, -0.004, 0.0, 0.004, 0.015])
def test_beside_a_sphere_lie_spheres(distance: float) -> None:
    (found,) = of(np.full(SHAPE, 0.12))
    radii = found.radius(np.full(SHAPE, distance))
    np.testing.assert_allclose(radii, 0.12 + distance, atol=VOXEL / 3)
    assert (radii - 0.12 - distance)[5:-5, 5:-5].std() < VOXEL / 30  # at the window's border they bend
    np.testing.assert_allclose(found.distance(radii), distance, atol=1e-9)


@pytest.mark.parametrize("chart", CHARTS, ids=str)
@pytest.mark.parametrize("distance", [-0.006, 0.006])
def test_they_keep_their_distance_from_a_wall(chart: Chart, distance: float) -> None:
    """By the distance from many points of a chin over a neck."""
    surface = ndimage.gaussian_filter(step(40), 1.0)
    (found,) = offsets(chart, WINDOW, [surface], FAR, VOXEL)
    uv = window_uv(WINDOW, *SHAPE)
    corners = chart.points(uv, surface).reshape(-1, 3)
    dense, _ = trimesh.remesh.subdivide_to_size(corners, grid_faces(SHAPE[0]), VOXEL / 2)
    points = chart.points(uv, found.radius(np.full(SHAPE, distance)))[8:-8, 10:-10:4].reshape(-1, 3)
    true, _ = cKDTree(dense).query(points)
    assert np.quantile(np.abs(true - abs(distance)), 0.95) < VOXEL / 4
    assert np.abs(true - abs(distance)).max() < VOXEL


def test_layers_are_nested_and_keep_off_the_centre() -> None:
    (found,) = offsets(CHARTS[0], WINDOW, [step(40)], 0.1, VOXEL)
    distances = np.broadcast_to(np.linspace(0.015, -0.09, 12), (*SHAPE, 12))
    radii = found.layers(distances)
    assert (np.diff(radii, axis=-1) < 0).all()
    assert MIN_RADIUS <= radii.min() < MIN_RADIUS + 1e-4


def test_they_pass_through_what_the_grid_smoothed() -> None:
    """But not through a wall: there it may stand a node aside."""
    fine = 0.12 + 0.002 * np.random.default_rng(0).uniform(-1, 1, SHAPE)
    fine[40:] -= 0.05
    (found,) = of(fine)
    still = np.zeros(SHAPE)
    smooth = found.radius(still)
    radii = found.through(fine, smooth, 2 * VOXEL).radius(still)
    near = np.abs(fine - smooth) < 2 * VOXEL
    assert np.abs(fine - smooth)[near].max() > 0.001 and 0.9 < near.mean() < 1
    np.testing.assert_allclose(radii[near], fine[near], atol=1e-9)
    np.testing.assert_array_equal(radii[~near], smooth[~near])


def test_a_wall_that_moves_has_layers_between() -> None:
    """Rows 36, 40 and 44: the mean stands at 40, and layers reach the other two."""
    surfaces = step(40), step(36), step(44)
    found = of(*surfaces)
    mean, reach = over_frames(found[0], list(zip(surfaces, found, strict=True)), np.full(SHAPE, 0.003))
    moved = 4 * (WINDOW[1] - WINDOW[0]) / (SHAPE[0] - 1) * np.pi / 2 * 0.125
    assert reach[40, 45] == pytest.approx(moved, rel=0.35)
    assert max(reach[:20].max(), reach[60:].max()) < 1e-9
    edges = [np.argmin(np.diff(mean.radius(by * reach)[:, 45])) for by in (1.0, 0.0, -1.0)]
    assert edges[1] in (39, 40) and edges[0] >= 42 and edges[2] <= 37
    still = np.zeros(SHAPE)
    np.testing.assert_allclose(mean.radius(still)[:20], found[0].radius(still)[:20], atol=1e-9)


def test_what_is_unknown_stands_still_or_strays_moves_nothing() -> None:
    still = np.full(SHAPE, 0.12)
    stray, near, unknown = still.copy(), still + 0.002, np.full(SHAPE, np.nan)
    stray[40:45, 40:45] += 0.05
    surface, *fields = of(still + 0.004, still, stray, near, still)
    frames = list(zip((still, stray, near, unknown), fields, strict=True))
    mean, reach = over_frames(surface, frames, np.full(SHAPE, 0.003))
    assert mean is surface and not reach.any()


def test_what_moves_moves_a_surface_that_is_not_quite_the_frames() -> None:
    still, bulge = np.full(SHAPE, 0.12), np.full(SHAPE, 0.12)
    bulge[40:60, 40:60] += 0.02
    surface, *fields = of(still + 0.004, still, bulge)
    mean, reach = over_frames(surface, list(zip((still, bulge), fields, strict=True)), np.full(SHAPE, 0.003))
    assert mean.radius(np.zeros(SHAPE))[50, 50] == pytest.approx(0.134, abs=0.001)
    assert reach[50, 50] == pytest.approx(0.01, abs=0.001)
    assert mean.radius(np.zeros(SHAPE))[10, 10] == pytest.approx(0.124, abs=0.001)
