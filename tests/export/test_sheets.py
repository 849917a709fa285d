"""Nested sheets from the samples: exact, in order, without faces where nothing was found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.export.decimation import exact_st
from facefolds_core.export.sampling import sample_grids
from facefolds_core.export.sheets import grid_sheets, sheet_faces, vertex_uv
from facefolds_core.export.stores import Grids
from facefolds_core.geometry.sphere_uv import Window
from tests.ellipsoids import Ellipsoids
from tests.export.order import full_meshes, layer_order

WINDOW: Window = (-0.5, 0.6, -0.3, 0.4)
CENTRE = np.array(Ellipsoids().chart.centre)


@pytest.fixture(scope="module")
def grids() -> Grids:
    return sample_grids(Ellipsoids(), 48, WINDOW)


def test_vertices_are_the_samples_and_faces_look_outward_and_fill_the_grid(grids: Grids) -> None:
    sheets = grid_sheets(grids, None)
    for layer, mesh in enumerate(full_meshes(sheets)):
        assert np.abs(mesh.vertices - grids.points[layer].reshape(-1, 3)).max() < 1e-6
        assert np.abs(mesh.st - exact_st(mesh.vertices, WINDOW, grids.chart)).max() < 1e-5
    towards, faces = sheets.chart.directions(vertex_uv(sheets)), sheet_faces(sheets)
    assert len(faces) == 2 * 47 * 47
    assert (np.linalg.det(towards[faces]) > 0).all()


def test_thinned_samples_keep_their_texture_coordinates(grids: Grids) -> None:
    sheets = grid_sheets(grids, 16)
    assert sheets.radii.shape == (2, 16, 16)
    assert sheets.st[0, 0] == pytest.approx([1.5 / 48, 1.5 / 48])  # every third sample, from the second on


def test_no_face_touches_a_sample_that_is_not_valid() -> None:
    grids = sample_grids(Ellipsoids(hole=0.1), 48, WINDOW)
    sheets = grid_sheets(grids, None)
    assert not grids.valid.all()
    for mesh, valid in zip(full_meshes(sheets), grids.valid, strict=True):
        row, column = np.rint(mesh.st[:, ::-1] * 48 - 0.5).astype(int).T
        assert valid[row, column].all()
    assert (sheets.radii > 0.2).all()  # and their radii are those of their surroundings


def test_a_diagonal_lies_along_a_jump_of_the_radius(grids: Grids) -> None:
    # One corner of the cell (10, 10) lies lower: the diagonal must not end there.
    for corner, falling in (((10, 10), False), ((10, 11), True), ((11, 10), True), ((11, 11), False)):
        points = grids.points.copy()
        points[:, corner[0], corner[1]] = 0.5 * (points[:, corner[0], corner[1]] + CENTRE)
        sheets = grid_sheets(replace(grids, points=points.astype(np.float32)), None)
        assert sheets.falling[10, 10] == falling


def test_samples_out_of_order_are_moved(grids: Grids) -> None:
    points = grids.points.copy()
    points[1, 5, 6] = CENTRE + 1.1 * (points[0, 5, 6] - CENTRE)
    made = grid_sheets(replace(grids, points=points), None)
    assert layer_order(full_meshes(made), grids.chart).crossed == 0
