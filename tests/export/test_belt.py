"""Export of a head on a neck: a ball above a chart's belt, a column below it, in a window behind the ears.

A chart's surface of constant radius R is a ball of radius R about c above the belt and a vertical cylinder of radius
R cos e below. The bumpy one has waves on both.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.export.collapse import decimated_ladder
from facefolds_core.export.decimation import decimate, exact_st, upright_faces
from facefolds_core.export.poisson import gather_samples, reconstruct
from facefolds_core.export.refit import radial_cosines, refit_radii
from facefolds_core.export.sampling import sample_grids
from facefolds_core.export.sheets import grid_sheets, sheet_faces, sheet_mesh, vertex_uv
from facefolds_core.export.stores import (
    Grids,
    Sheets,
    read_grids,
    read_places,
    read_surfaces,
    write_grids,
    write_sheets,
)
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.meshes import Surface
from facefolds_core.geometry.rays import EmbreeMesh
from facefolds_core.geometry.sphere_uv import Window, texel_uv, uv_to_st
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import ExplicitSpec, build_model
from facefolds_core.params import ReconstructParams
from tests.assets import grid_faces
from tests.export.order import layer_order
from tests.model.manifolds import layered

CHART = Chart((-0.25, 0.0, 0.05), Belt(0.2, 0.3))
WINDOW: Window = (-1.0, 0.7, -1.3, 1.3)
N = 64
RADII = (0.26, 0.24)


def model(waves: float = 0.0) -> RadianceManifolds:
    """Two layers; those of the bumpy model stay 0.02 apart."""
    assert CHART.belt is not None
    spec = ExplicitSpec(
        centre=CHART.centre, belt=CHART.belt, window=WINDOW, nodes=(48, 60), texels=(8, 8), num_layers=2, num_frames=1
    )
    made = build_model(spec)
    assert isinstance(made.manifolds, RadialManifolds)
    u, v = texel_uv(48, 60, WINDOW).transpose(2, 0, 1)
    middle = 0.25 + waves * np.sin(7 * u + 1) * np.cos(5 * v)
    made.manifolds.maps = layered(torch.tensor(middle, dtype=torch.float32), 0.01, 2)
    return made


@pytest.fixture(scope="module")
def grids() -> Grids:
    return sample_grids(model(), N, WINDOW)


@pytest.fixture(scope="module")
def sheets(grids: Grids) -> Sheets:
    return grid_sheets(grids, None)


@pytest.fixture(scope="module")
def bumpy() -> Sheets:
    return grid_sheets(sample_grids(model(0.02), N, WINDOW), None)


def off(points: NDArray[np.float32], radius: float) -> NDArray[np.float64]:
    """How far points lie outside the layer of a constant radius, as the crow flies, away from the belt."""
    offset = points.astype(np.float64) - np.array(CHART.centre)
    below = CHART.below(CHART.uv(points.astype(np.float64))[0])
    assert CHART.belt is not None
    flat = np.linalg.norm(offset[..., :2], axis=-1) - radius * np.cos(CHART.belt.elevation)
    return np.where(below, flat, np.linalg.norm(offset, axis=-1) - radius)


def test_samples_lie_on_the_ball_and_the_column_with_their_normals(grids: Grids) -> None:
    uv = texel_uv(N, N, WINDOW)
    below = CHART.below(uv)
    assert 0.3 < below.mean() < 0.7
    for points, normals, radius in zip(grids.points, grids.normals, RADII, strict=True):
        assert np.abs(off(points, radius)).max() < 1e-6
        np.testing.assert_allclose(CHART.uv(points.astype(np.float64))[0], uv, atol=1e-5)
        true = (points - np.array(CHART.centre)) * np.where(below, 0, 1)[..., None] ** np.array([0, 0, 1])
        true /= np.linalg.norm(true, axis=-1, keepdims=True)
        beside = np.abs(uv[..., 0] - CHART.lowest) < 2 * 1.7 / N  # chords across the edge at the belt
        assert (true * normals).sum(-1)[~beside].min() > np.cos(np.radians(2.5))  # seen: 2.4, one-sided at the border


def test_faces_of_the_grid_keep_their_side(sheets: Sheets) -> None:
    uv, faces = vertex_uv(sheets), sheet_faces(sheets)
    assert np.abs(sheets.radii - np.array(RADII)[:, None, None]).max() < 1e-6
    assert (np.linalg.det(CHART.unrolled(uv)[faces]) > 0).all()
    mesh = sheet_mesh(sheets, 0, faces, uv)
    assert upright_faces(mesh.vertices, mesh.faces, CHART).all()
    assert not upright_faces(mesh.vertices, mesh.faces[:, ::-1], CHART).any()


@pytest.mark.parametrize("count", [144, 400])
def test_the_shape_stays_when_it_is_decimated(sheets: Sheets, count: int) -> None:
    meshes = decimated_ladder(sheets, [count])[count]
    for mesh, radius in zip(meshes, RADII, strict=True):
        assert len(mesh.vertices) == count
        middle = mesh.vertices[mesh.faces].mean(1)
        assert np.abs(off(middle, radius)).max() < 0.06 * radius * 144 / count
        assert np.abs(mesh.st - exact_st(mesh.vertices, WINDOW, CHART)).max() < 1e-5
        assert upright_faces(mesh.vertices, mesh.faces, CHART).all()
    order = layer_order(meshes, CHART)
    assert order.compared > count and order.deepest < 1e-6


def test_decimated_layers_of_a_bumpy_column_stay_upright_and_in_order(bumpy: Sheets) -> None:
    meshes = decimated_ladder(bumpy, [300])[300]
    for mesh in meshes:
        assert upright_faces(mesh.vertices, mesh.faces, CHART).all()
    assert layer_order(meshes, CHART).crossed == 0
    uv = np.random.default_rng(0).uniform([-0.97, -1.27], [0.67, 1.27], (5000, 2))  # and between the vertices
    outer, inner = (cast(mesh, uv) for mesh in meshes)
    assert (outer - inner).min() > 0.015  # of 0.02; NaN where a ray finds a hole


def cast(mesh: Surface, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Radii at which the chart's rays meet a mesh, NaN where they do not."""
    origins = CHART.origins(uv)
    hits = EmbreeMesh(mesh.vertices, mesh.faces).nearest(origins, CHART.directions(uv))
    corners = mesh.vertices[mesh.faces[hits.triangle]].astype(np.float64)
    points = (hits.barycentric[..., None] * corners).sum(1)
    return np.where(hits.triangle >= 0, np.linalg.norm(points - origins, axis=-1), np.nan)


def test_fitted_radii_err_less_than_those_of_the_samples(bumpy: Sheets) -> None:
    every_ninth = np.arange(N * N).reshape(N, N)[::9, ::9]
    faces = every_ninth.reshape(-1)[grid_faces(len(every_ninth))]
    fitted = refit_radii(bumpy, np.ones(bumpy.radii.shape), faces, vertex_uv(bumpy))
    for layer in range(bumpy.num_layers):
        for below, share in ((False, 0.6), (True, 0.7)):  # seen: 0.49 and 0.59
            before, after = (radial_errors(kept, bumpy, layer, faces, below) for kept in (bumpy, fitted))
            assert np.sqrt((after**2).mean()) < share * np.sqrt((before**2).mean())
    assert (np.diff(fitted.radii, axis=0) <= 0).all()


def radial_errors(
    coarse: Sheets, sheets: Sheets, layer: int, faces: NDArray[np.int64], below: bool
) -> NDArray[np.float64]:
    """Radius of a coarse mesh, by casting the chart's rays of one side of the belt, minus that of the samples."""
    uv = vertex_uv(sheets)
    mine = CHART.below(uv) == below
    errors = cast(sheet_mesh(coarse, layer, faces, uv), uv[mine]) - sheets.radii[layer].reshape(-1)[mine]
    assert np.isfinite(errors).mean() > 0.8
    return np.asarray(errors[np.isfinite(errors)])


def test_cosines_of_a_cone_are_those_of_its_normals() -> None:
    """Belt at elevation 0; the radius grows by 0.1 a radian of u downwards: a slope of 1 in 3 of the girth 0.3."""
    window: Window = (-1.2, -0.2, -1.0, 1.0)
    u = texel_uv(32, 32, window)[..., 0] * np.pi / 2
    everywhere = np.ones((1, 32, 32), bool)
    st = uv_to_st(texel_uv(32, 32, window), window)
    chart = Chart((0.0, 0.0, 0.0), Belt(0.0, 0.3))
    cone = Sheets(
        st, (0.2 - 0.1 * u)[None], everywhere, 255 * everywhere, everywhere[0, 1:, 1:], np.array(window), chart
    )
    np.testing.assert_allclose(radial_cosines(cone, 0), 1 / np.hypot(1, 1 / 3), atol=1e-3)


def test_poisson_surfaces_are_decimated_upright(grids: Grids) -> None:
    dense = reconstruct(gather_samples(grids, 0, None), ReconstructParams(depth=6), 0)
    assert len(dense.faces) > 2000
    coarse = decimate(dense, 20**2, CHART)
    assert 0.9 * 20**2 < len(coarse.vertices) <= 20**2
    assert upright_faces(coarse.vertices, coarse.faces, CHART).all()
    assert np.abs(off(coarse.vertices, RADII[0])).mean() < 0.003
    inner = Surface(coarse.vertices - 0.02 * CHART.outward(coarse.vertices.astype(np.float64)), coarse.faces)
    assert layer_order([coarse, inner], CHART).crossed == 0
    turned = layer_order([inner, coarse], CHART)
    assert turned.crossed == turned.compared > 500


@pytest.mark.parametrize("belt", [(-0.1, 0.3), (np.pi / 2, 0.3), (0.2, 0.0), (0.2, -1.0), (0.2, np.nan), (0.2, 1e300)])
def test_a_damaged_belt_is_refused(tmp_path: Path, grids: Grids, sheets: Sheets, belt: tuple[float, float]) -> None:
    chart = replace(CHART, belt=Belt(*belt))
    write_grids(tmp_path / "grids.npz", replace(grids, chart=chart))
    write_sheets(tmp_path / "sheets.npz", replace(sheets, chart=chart))
    for read, name in ((read_grids, "grids.npz"), (read_places, "grids.npz"), (read_surfaces, "sheets.npz")):
        with pytest.raises(UserError, match="belt"):
            read(tmp_path / name)


def test_a_belt_of_three_numbers_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "grids.npz", centre=np.zeros(3), belt=np.ones(3))
    with pytest.raises(UserError, match="belt"):
        read_places(tmp_path / "grids.npz")
