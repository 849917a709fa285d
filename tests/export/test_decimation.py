"""Decimation keeps its bound and the shape; texture coordinates; order of the layers."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.export.decimation import decimate, decimate_layers, exact_st, nearest_st, upright_faces
from facefolds_core.export.poisson import gather_samples, reconstruct
from facefolds_core.export.sampling import sample_grids
from facefolds_core.export.stores import Grids
from facefolds_core.geometry.meshes import Surface
from facefolds_core.geometry.sphere_uv import Window, uv_to_directions, uv_to_st
from facefolds_core.params import DecimateParams, ReconstructParams
from tests.ellipsoids import Ellipsoids
from tests.export.order import boundary_loops, layer_order

WINDOW: Window = (-0.5, 0.6, -0.3, 0.4)
CHART = Ellipsoids().chart
CENTRE = np.array(CHART.centre)


@pytest.fixture(scope="module")
def grids() -> Grids:
    return sample_grids(Ellipsoids(), 96, WINDOW)


@pytest.fixture(scope="module")
def surfaces(grids: Grids) -> list[Surface]:
    params = ReconstructParams(depth=6)
    return [reconstruct(gather_samples(grids, i, None), params, i) for i in range(grids.num_layers)]


@pytest.mark.parametrize("resolution", [8, 16, 32])
def test_the_bound_is_used_and_the_shape_stays(surfaces: list[Surface], resolution: int) -> None:
    coarse = decimate(surfaces[0], resolution**2, CHART)
    count = len(coarse.vertices)
    assert 0.9 * resolution**2 < count <= resolution**2
    scaled = (coarse.vertices - CENTRE) / np.array(Ellipsoids().axes[0])
    assert np.abs(np.linalg.norm(scaled, axis=-1) - 1).mean() < 1e-3 * (32 / resolution) ** 2
    assert boundary_loops(coarse.faces) == 1
    assert np.array_equal(np.unique(coarse.faces), np.arange(count))
    assert np.array_equal(decimate(coarse, count, CHART).vertices, coarse.vertices)  # it is below the bound


def test_faces_that_turn_over_or_have_no_area_are_found() -> None:
    vertices = np.array([[0.1, 0, 0], [0.1, 0.1, 0], [0.1, 0, 0.1], [0.1, 0.05, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 1], [0, 1, 1], [0, 3, 1]], np.int32)
    assert upright_faces(vertices, faces, CHART).tolist() == [True, False, False, False]


def test_nearest_texture_coordinates_are_a_texel_centre_half_a_texel_away_at_most(grids: Grids) -> None:
    vertices = grids.points[0].reshape(-1, 3)[::7] + np.float32(1e-4)
    st = nearest_st(vertices, grids.points[0], grids.valid[0])
    texel = st * 96 - 0.5
    assert np.abs(texel - np.rint(texel)).max() < 1e-3
    assert np.abs(st - exact_st(vertices, WINDOW, CHART)).max() < 0.75 / 96


def test_nearest_texture_coordinates_skip_invalid_samples(grids: Grids) -> None:
    valid = np.zeros((96, 96), bool)
    valid[10, 20] = True
    st = nearest_st(grids.points[0].reshape(-1, 3)[:5], grids.points[0], valid)
    assert np.allclose(st, [20.5 / 96, 10.5 / 96])


def test_exact_texture_coordinates_are_the_direction() -> None:
    uv = np.array([[0.1, -0.2], [-0.4, 0.3], [0.9, 0.0]])
    st = exact_st((CENTRE + 0.3 * uv_to_directions(uv)).astype(np.float32), WINDOW, CHART)
    assert np.allclose(st[:2], uv_to_st(uv[:2], WINDOW), atol=1e-6)
    assert st[2, 1] == 0  # beyond the window's top: its edge


def test_layers_in_order_do_not_cross(grids: Grids, surfaces: list[Surface]) -> None:
    order = layer_order(decimate_layers(surfaces, grids, 16, DecimateParams()), CHART)
    assert order.compared > 200
    assert order.crossed == 0


def test_a_surface_too_many_is_an_error(grids: Grids, surfaces: list[Surface]) -> None:
    with pytest.raises(UserError, match="do not belong together"):
        decimate_layers(surfaces * 2, grids, 16, DecimateParams())


def test_where_nothing_is_left_of_a_layer_its_resolution_is_named(grids: Grids, surfaces: list[Surface]) -> None:
    """Faces that all look inwards are dropped."""
    inwards = [Surface(one.vertices, np.ascontiguousarray(one.faces[:, ::-1])) for one in surfaces]
    with pytest.raises(UserError, match="left nothing") as caught:
        decimate_layers(inwards, grids, 16, DecimateParams())
    assert "R^m 16" in str(caught.value) and "decimate.resolution" in str(caught.value)
