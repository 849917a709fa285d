"""Gaussians as a grid: optical depths in closed form, and where the surface lies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.geometry.chart import Chart
from facefolds_core.rendering.compositing import transmittance_before
from facefolds_core.subject.outline import profile, shells, visible_points
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, TURN, Splats
from facefolds_core.subject.volume import MARGIN, Volume, volume_of
from tests.scenes import OPAQUE, gaussians, look_at_origin


def one(opacity: float, sizes: tuple[float, float, float], turn: tuple[float, ...] = (1, 0, 0, 0)) -> Splats:
    """A Gaussian at the origin, and two that are not to be seen, at the ends of the box."""
    values = np.zeros((3, COLUMNS), np.float32)
    values[1:, MEAN] = [[-0.2, -0.2, -0.2], [0.2, 0.2, 0.2]]
    values[:, SCALE], values[:, TURN] = np.log(sizes), turn
    values[:, OPACITY] = [math.log(opacity / (1 - opacity)), -12, -12]
    values[:, COLOUR] = (0.2, 0.5, 0.9)
    return Splats(values, np.zeros(3, np.float32))


def through(volume: Volume, towards: tuple[float, float, float]) -> tuple[np.ndarray, float]:
    """Colour and opacity of a ray through the origin."""
    d = np.array([towards]) / np.linalg.norm(towards)
    rgb, alpha, _ = volume.render(-d, d)
    return rgb[0], float(alpha[0])


@pytest.mark.parametrize("opacity", [0.3, 0.9])
@pytest.mark.parametrize("turn", [(1, 0, 0, 0), (math.cos(0.3), 0, math.sin(0.3), 0)])
def test_across_its_face_a_gaussian_is_as_opaque_as_it_is(opacity: float, turn: tuple[float, ...]) -> None:
    volume = volume_of(one(opacity, (0.004, 0.06, 0.06), turn))
    w, _, y, _ = turn
    rgb, alpha = through(volume, (1 - 2 * y * y, 0, -2 * w * y))  # its shortest axis
    assert alpha == pytest.approx(opacity, rel=0.03)
    np.testing.assert_allclose(rgb / alpha, (0.2, 0.5, 0.9), atol=0.01)


def test_what_is_thinner_than_a_voxel_is_not_lost() -> None:
    thin, thick = (through(volume_of(one(0.6, (s, 0.06, 0.06))), (1, 0, 0))[1] for s in (1e-5, 3e-3))
    assert thin == pytest.approx(thick, rel=0.05)


def test_the_box_holds_them_all_with_a_margin() -> None:
    volume = volume_of(one(0.5, (0.01, 0.01, 0.01)), cells=60)
    upper = volume.lower + volume.voxel * (np.array(volume.grid.shape[:3]) - 1)
    assert max(volume.grid.shape[:3]) in (60, 61)
    np.testing.assert_allclose(volume.lower, -0.2 - MARGIN, atol=0.01)
    assert (upper > 0.2).all()
    assert through(volume, (0, 0.7, 0.7))[1] < 0.6 and np.isfinite(volume.grid).all()


def test_a_sphere_lies_where_it_is() -> None:
    """Within a voxel, seen from its centre and by cameras."""
    volume = volume_of(gaussians(OPAQUE))
    chart = Chart(SPHERE_CENTRE)
    uv = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 2))
    seen = profile(volume, chart, uv, 0.5)
    assert np.isfinite(seen.radius).all() and (seen.opacity > 0.8).all()
    assert np.median(np.abs(seen.radius - OPAQUE[0].radius)) < volume.voxel
    points = visible_points(volume, [look_at_origin("a", 10, 0, 40)])
    distance = np.linalg.norm(points - np.array(SPHERE_CENTRE), axis=1)
    assert np.quantile(np.abs(distance - OPAQUE[0].radius), 0.9) < 2 * volume.voxel


def test_layers_composited_show_what_the_volume_shows() -> None:
    """Whatever their radii, if they span it: optical depths only change place."""
    rng = np.random.default_rng(0)
    volume, chart, uv = volume_of(gaussians(OPAQUE)), Chart(SPHERE_CENTRE), rng.uniform(-0.5, 0.5, (100, 2))
    seen = profile(volume, chart, uv, 0.5)
    for layers in (1, 2, 7):
        reach = 3 * volume.voxel * np.sort(rng.uniform(-1, 1, (100, layers)))[:, ::-1]
        reach[:, [0, -1]] = (3 * volume.voxel, -3 * volume.voxel) if layers > 1 else 0
        opacity, rgb = shells(volume, chart, uv, seen.radius[:, None] + reach)
        weight = opacity * transmittance_before(opacity, -1)
        np.testing.assert_allclose(weight.sum(-1), seen.opacity, atol=0.02)
        shown = (weight[..., None] * rgb).sum(1) / np.maximum(weight.sum(-1), 1e-6)[:, None]
        np.testing.assert_allclose(shown, seen.rgb, atol=0.05)  # worst seen: 0.036, where neighbours share a sample


def test_a_surface_between_two_layers_is_shared_out_by_its_distance() -> None:
    """And one that is far from all of them is left out."""
    volume, chart = volume_of(one(0.9, (1e-4, 0.06, 0.06)), cells=200), Chart((-0.1, 0.0, 0.0))
    ahead = np.zeros((1, 2))
    opacity, rgb = shells(volume, chart, ahead, np.array([[0.13, 0.12, 0.09, 0.05]]))
    depth = -np.log1p(-opacity[0].astype(np.float64))
    np.testing.assert_allclose(depth / depth.sum(), [0, 1 / 3, 2 / 3, 0], atol=0.02)
    assert -np.expm1(-depth.sum()) == pytest.approx(0.9, abs=0.01)
    np.testing.assert_allclose(rgb[0, 1:3], np.tile((0.2, 0.5, 0.9), (2, 1)), atol=0.01)
    assert not shells(volume, chart, ahead, np.array([[0.08, 0.07]]))[0].any()
