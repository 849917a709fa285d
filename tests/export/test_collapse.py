"""Decimation over one triangulation for all layers: bounds, borders, order, exact texture coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.export.collapse import contribution, decimated_ladder
from facefolds_core.export.decimation import exact_st
from facefolds_core.export.refit import radial_cosines
from facefolds_core.export.sampling import sample_grids
from facefolds_core.export.sheets import grid_sheets, vertex_uv
from facefolds_core.export.stores import Sheets
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window, closed
from tests.ellipsoids import Ellipsoids
from tests.export.order import boundary_loops, layer_order

WINDOW: Window = (-0.5, 0.6, -0.3, 0.4)
N = 64
CENTRE = np.array(Ellipsoids().chart.centre)


@pytest.fixture(scope="module")
def sheets() -> Sheets:
    return grid_sheets(sample_grids(Ellipsoids(), N, WINDOW), None)


def rough(sheets: Sheets, seed: int) -> Sheets:
    """Radii that jump by up to a half from vertex to vertex, all layers within 1e-4 of each other."""
    rng = np.random.default_rng(seed)
    outer = rng.uniform(0.2, 0.4, sheets.radii.shape[1:])
    radii = np.stack([outer, outer - rng.uniform(0, 1e-4, outer.shape)])
    return replace(sheets, radii=radii.astype(np.float32))


@pytest.mark.parametrize("target", [64, 256, 1024])
def test_the_bound_on_the_vertices_is_met(sheets: Sheets, target: int) -> None:
    for mesh in decimated_ladder(sheets, [target])[target]:
        assert len(mesh.vertices) == target
        assert np.array_equal(np.unique(mesh.faces), np.arange(target))


def test_the_shape_and_the_texture_coordinates_stay(sheets: Sheets) -> None:
    for mesh, axes in zip(decimated_ladder(sheets, [256])[256], Ellipsoids().axes, strict=True):
        middle = mesh.vertices[mesh.faces].mean(1)
        assert np.abs(np.linalg.norm((middle - CENTRE) / np.array(axes), axis=-1) - 1).max() < 0.01
        assert np.abs(mesh.st - exact_st(mesh.vertices, WINDOW, sheets.chart)).max() < 1e-5
        drift = mesh.st[mesh.faces].mean(1) - exact_st(middle.astype(np.float32), WINDOW, sheets.chart)
        assert np.abs(drift).max() < 0.005


def test_cosines_are_those_of_the_normals(sheets: Sheets) -> None:
    for layer, axes in enumerate(Ellipsoids().axes):
        outward = sheets.chart.directions(vertex_uv(sheets))
        points = sheets.radii[layer].reshape(-1, 1) * outward
        normals = points / np.array(axes) ** 2
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        cosines = (normals * outward).sum(-1).reshape(N, N)
        inside = (slice(1, -1), slice(1, -1))  # differences are one-sided at the border
        assert np.abs(radial_cosines(sheets, layer) - cosines)[inside].max() < 1e-3


def test_the_border_stays_where_it_was(sheets: Sheets) -> None:
    for mesh in decimated_ladder(sheets, [100])[100]:
        assert boundary_loops(mesh.faces) == 1
        assert mesh.st.min() == pytest.approx(0.5 / N)
        assert mesh.st.max() == pytest.approx(1 - 0.5 / N)
        assert covered_area(mesh) == pytest.approx((1 - 1 / N) ** 2, rel=1e-5)


@pytest.mark.parametrize("bumps", [0.0, 0.05])
def test_a_window_that_goes_all_around_is_closed_behind(bumps: float) -> None:
    """Where the head's two sides differ their borders lose other vertices, and part by what a chord cuts off."""
    grids = sample_grids(Ellipsoids(), N, (-0.5, 0.6, -2.0, 2.0))
    grids.valid[0, : N // 4, 0] = False  # the other side alone knows a radius there
    sheets = grid_sheets(grids, None)
    side = np.linspace(-1, 1, N) * (1 - np.linspace(-1, 1, N) ** 2)  # left and right differ, none on the borders
    wave = np.sin(np.arange(N) * np.where(side < 0, 0.3, 0.7)[:, None]).T
    sheets = replace(sheets, radii=sheets.radii * (1 + bumps * side * wave).astype(np.float32))
    for mesh in decimated_ladder(sheets, [1600])[1600]:
        assert (mesh.st[:, 0].min(), mesh.st[:, 0].max()) == (0, 1)
        left, right = (mesh.vertices[mesh.st[:, 0] == end] for end in (0, 1))
        left, right = (border[np.argsort(border[:, 2])].astype(np.float64) for border in (left, right))
        for axis in (0, 1):
            assert np.abs(np.interp(right[:, 2], left[:, 2], left[:, axis]) - right[:, axis]).max() < 0.002


def test_a_narrow_gap_behind_is_closed() -> None:
    assert closed((-0.5, 0.5, -1.93, 1.99)) == (-0.5, 0.5, -2, 2)
    assert closed((-0.5, 0.5, -1.5, 1.99)) == (-0.5, 0.5, -1.5, 1.99)


def covered_area(mesh: TexturedMesh) -> float:
    a, b, c = mesh.st[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    areas = -0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (areas > 0).all()
    return float(areas.sum())


@pytest.mark.parametrize("seed", range(5))
def test_layers_never_cross_and_faces_never_turn_over(sheets: Sheets, seed: int) -> None:
    meshes = decimated_ladder(rough(sheets, seed), [300])[300]
    order = layer_order(meshes, sheets.chart)
    assert order.compared > 500
    assert order.deepest < 1e-7  # rounding of the vertices to float32
    for mesh in meshes:
        assert covered_area(mesh) == pytest.approx((1 - 1 / N) ** 2, rel=1e-5)


def test_vertices_gather_where_the_radius_jumps(sheets: Sheets) -> None:
    radii = np.full_like(sheets.radii, 0.3)
    radii[1] = 0.29
    radii[:, :, N // 2 :] += 0.05
    (mesh, _) = decimated_ladder(replace(sheets, radii=radii), [256])[256]
    column = mesh.st[:, 0] * N - 0.5
    assert (np.abs(column - (N / 2 - 0.5)) < 1).mean() > 0.1  # 2 of 64 columns, 3 %; seen: 16 %
    radius = np.linalg.norm(mesh.vertices - CENTRE, axis=-1)
    assert np.minimum(np.abs(radius - 0.3), np.abs(radius - 0.35)).max() < 2e-3


@pytest.mark.parametrize("seed", range(3))
def test_beside_walls_no_vertex_lies_beyond_what_was_sampled(sheets: Sheets, seed: int) -> None:
    """Few samples show, as on a second surface: least squares alone reach several units."""
    walls = rough(sheets, seed)
    seldom = (np.random.default_rng(seed).random(walls.opacity[:2].shape) < 0.02) * np.uint8(255)
    walls = replace(walls, opacity=seldom)
    for mesh in decimated_ladder(walls, [256])[256]:
        radius = np.linalg.norm(mesh.vertices - CENTRE, axis=-1)
        assert radius.min() > 0.89 * 0.2 and radius.max() < 1.11 * 0.4


def test_triangles_that_hold_nothing_stay(sheets: Sheets) -> None:
    """Through a hole in a layer's front its back would be drawn over all others."""
    opacity = sheets.opacity.copy()
    opacity[0, :, 20:] = 0
    first, second = decimated_ladder(replace(sheets, opacity=opacity), [100])[100]
    assert np.array_equal(first.faces, second.faces)


def test_contributions_are_compositing_weights_with_a_floor() -> None:
    opacity = np.array([51, 255, 255], np.uint8)[:, None, None]
    assert contribution(opacity)[:, 0, 0] == pytest.approx([0.2, 0.8, 0.05])


def test_a_ladder_is_what_each_number_of_vertices_gives_alone(sheets: Sheets) -> None:
    for count, meshes in decimated_ladder(sheets, [100, 400, 200]).items():
        for mesh, alone in zip(meshes, decimated_ladder(sheets, [count])[count], strict=True):
            assert np.array_equal(mesh.faces, alone.faces)
            assert np.array_equal(mesh.vertices, alone.vertices)
