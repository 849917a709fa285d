"""Charts: there and back, one map across the belt, the sphere without one, and the compiled map."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.chart_kernel import chart_position
from facefolds_core.geometry.sphere_uv import points_to_uv, uv_to_directions
from facefolds_core.kernels.jit import kernel

C = (-0.25, 0.1, 0.05)
SPHERE = Chart(C)
BELTS = [Belt(0.0, 0.3), Belt(0.2, 0.25), Belt(1.2, 0.5)]
CHARTS = [Chart(C, belt) for belt in BELTS]


def places(chart: Chart) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(u, v) above and below the belt, before and behind the ears, and radii."""
    rng = np.random.default_rng(0)
    lowest = -0.95 if chart.belt is None else -1.8
    return rng.uniform([lowest, -1.95], [0.95, 1.95], (500, 2)), rng.uniform(0.1, 0.6, 500)


@kernel
def positions(offsets, belt, out):  # type: ignore[no-untyped-def]
    for i in range(len(offsets)):
        u, v, r = chart_position(offsets[i, 0], offsets[i, 1], offsets[i, 2], belt)
        out[i, 0] = u
        out[i, 1] = v
        out[i, 2] = r


@pytest.mark.parametrize("chart", [SPHERE, *CHARTS], ids=str)
def test_there_and_back_in_numpy_and_torch(chart: Chart) -> None:
    uv, radius = places(chart)
    if chart.belt is not None:
        assert 0.2 < chart.below(uv).mean() < 0.8
    points = chart.points(uv, radius)
    tensor = chart.points(torch.from_numpy(uv), torch.from_numpy(radius))
    np.testing.assert_allclose(tensor.numpy(), points, atol=1e-14)
    for back, found in (chart.uv(points), chart.uv(tensor)):
        np.testing.assert_allclose(back, uv, atol=1e-12)
        np.testing.assert_allclose(found, radius, atol=1e-12)
    assert chart.uv(tensor.float())[0].dtype == torch.float32


def test_below_the_belt_in_closed_form() -> None:
    """A radian of u below it is a girth down the axis, and a radius is measured along the slope."""
    chart = Chart(C, Belt(math.radians(30), 0.4))
    down = 0.25 * 0.4 + 0.2 * math.sin(math.radians(30))
    point = np.add(C, (0.0, -0.2 * math.cos(math.radians(30)), -down))
    uv, radius = chart.uv(point)
    assert uv == pytest.approx([-2 / math.pi * (math.radians(30) + 0.25), -1.0])
    assert radius == pytest.approx(0.2)
    assert chart.outward(point) == pytest.approx([0, -math.cos(math.radians(30)), -0.5])


@pytest.mark.parametrize("chart", CHARTS, ids=str)
def test_the_map_has_no_step_across_the_belt(chart: Chart) -> None:
    _, radius = places(chart)
    v = np.linspace(-1.9, 1.9, len(radius))
    sides = [np.stack([np.full_like(v, chart.lowest + step), v], -1) for step in (-1e-9, 1e-9)]
    assert chart.below(sides[0]).all() and not chart.below(sides[1]).any()
    under, over = (chart.points(side, radius) for side in sides)
    np.testing.assert_allclose(under, over, atol=3e-9)
    for moved in (-1e-9, 1e-9):
        uv, found = chart.uv(over + np.array([0, 0, moved]))
        np.testing.assert_allclose(uv[:, 0], chart.lowest, atol=3e-8)
        np.testing.assert_allclose(found, radius, atol=3e-9)


@pytest.mark.parametrize("chart", [SPHERE, *CHARTS], ids=str)
def test_what_is_not_below_a_belt_is_the_spheres(chart: Chart) -> None:
    points = np.array(C) + np.random.default_rng(1).uniform(-0.5, 0.5, (500, 3))
    above = ~chart.below(chart.uv(points)[0])
    assert above.sum() > 200 and above.all() == (chart.belt is None)
    expected, radius = points_to_uv(points, np.array(C))
    found = chart.uv(points)
    assert np.array_equal(found[0][above], expected[above]) and np.array_equal(found[1][above], radius[above])
    assert np.array_equal(chart.directions(expected)[above], uv_to_directions(expected)[above])
    assert (np.abs(found[0] - expected).max(-1)[~above] > 0).all()


@pytest.mark.parametrize("chart", [SPHERE, *CHARTS], ids=str)
def test_triangles_keep_their_side_everywhere(chart: Chart) -> None:
    """Anticlockwise as seen from outside, of sides up to a tenth; a third of them across the belt."""
    rng = np.random.default_rng(2)
    uv, radius = places(chart)
    if chart.belt is not None:
        uv[::3, 0] = chart.lowest + rng.uniform(-0.03, 0.03, len(uv[::3]))
    turn = rng.uniform(0, 2 * np.pi, len(uv))[:, None] + 2 * np.pi / 3 * np.arange(3)
    corners = uv[:, None] + 0.05 * np.stack([np.sin(turn), np.cos(turn)], -1)
    corners[..., 0] = corners[..., 0].clip(None, 0.99)
    unrolled = chart.unrolled(corners)
    assert (np.linalg.det(unrolled) > 0).all()
    assert (np.linalg.det(unrolled[:, ::-1]) < 0).all()
    a, b, c = chart.points(corners, np.repeat(radius[:, None], 3, 1)).transpose(1, 0, 2)
    outward = chart.outward((a + b + c) / 3)
    assert ((np.cross(b - a, c - a) * outward).sum(-1) > 0).all()


@pytest.mark.parametrize("chart", [SPHERE, *CHARTS], ids=str)
def test_the_compiled_map_is_the_charts(chart: Chart) -> None:
    points = np.array(C) + np.random.default_rng(3).uniform(-0.5, 0.5, (500, 3))
    found = np.empty((500, 3))
    positions(points - np.array(C), chart.numbers, found)
    uv, radius = chart.uv(points)
    np.testing.assert_allclose(found, np.concatenate([uv, radius[:, None]], 1), atol=1e-12)
    positions(np.array([[0.0, 0.0, 1e-9]]), chart.numbers, found[:1])
    assert np.isfinite(found[0]).all()
