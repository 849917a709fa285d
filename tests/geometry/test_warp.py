"""Warps: areas, there and back, borders, windows that go all around, what is no warp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.sphere_uv import Window, window_uv
from facefolds_core.geometry.warp import Warp, evened
from tests.warps import ring, ring_warp

OPEN, AROUND = (-0.9, 0.7, -1.2, 1.4), (-0.9, 0.9, -2.0, 2.0)
WINDOWS = pytest.mark.parametrize("window", [OPEN, AROUND])


def inner(window: Window) -> np.ndarray:
    u0, u1, v0, v1 = window
    return np.random.default_rng(0).uniform([u0, v0], [u1, v1], (400, 2))


@WINDOWS
def test_each_place_has_room_in_proportion_to_its_density(window: Window) -> None:
    u0, u1, v0, v1 = window
    density, forth = ring(window), ring_warp(window).forth
    (uu, uv), (vu, vv) = (np.gradient(forth[..., k]) for k in range(2))
    rows, columns = density.shape
    room = (uv * vu - uu * vv) * (rows - 1) * (columns - 1) / ((u1 - u0) * (v1 - v0))
    wanted = density / density[:-1, :-1].mean()
    np.testing.assert_allclose(room[2:-2, 2:-2], wanted[2:-2, 2:-2], rtol=0.05)
    assert room.max() > 1.7 and room.min() < 0.8


@WINDOWS
def test_there_and_back_in_numpy_and_torch(window: Window) -> None:
    warp, uv = ring_warp(window), inner(window)
    there = warp.apply(uv)
    assert np.abs(there - uv).max() > 0.05
    np.testing.assert_allclose(warp.undo(there), uv, atol=3e-3)  # a third of a node
    for way in (warp.apply, warp.undo):
        np.testing.assert_allclose(way(torch.from_numpy(uv)).numpy(), way(uv), atol=1e-12)
        assert way(torch.from_numpy(uv).float()).dtype == torch.float32


def test_borders_stay_borders_and_take_along_what_is_outside() -> None:
    u0, u1, v0, v1 = OPEN
    forth = ring_warp(OPEN).forth
    for edge, value in ((forth[0, :, 0], u1), (forth[-1, :, 0], u0), (forth[:, 0, 1], v0), (forth[:, -1, 1], v1)):
        np.testing.assert_allclose(edge, value, atol=1e-12)
    near, far = ring_warp(OPEN).apply(np.array([[0.1, v1], [0.1, v1 + 0.3]]))
    np.testing.assert_allclose(far - near, [0, 0.3], atol=1e-12)


def test_all_around_the_ends_of_v_are_one_line() -> None:
    warp = ring_warp(AROUND)
    np.testing.assert_allclose(warp.forth[:, -1] - warp.forth[:, 0], np.tile([0.0, 4.0], (65, 1)), atol=1e-9)
    aside = evened(np.roll(ring(AROUND)[:, :-1], 40, 1)[:, [*range(80), 0]], AROUND)  # the ring lies across that line
    uv = inner(AROUND)
    turned = np.stack([uv[:, 0], np.where(uv[:, 1] > 0, uv[:, 1] - 2, uv[:, 1] + 2)], -1)
    apart = warp.apply(uv) - aside.apply(turned)
    np.testing.assert_allclose(apart[:, 0], 0, atol=2e-3)
    np.testing.assert_allclose(np.abs(apart[:, 1]), 2, atol=2e-3)


@WINDOWS
def test_an_even_density_moves_nothing(window: Window) -> None:
    warp = evened(np.full((9, 11), 7.0), window)
    np.testing.assert_allclose(warp.forth, window_uv(window, 9, 11), atol=1e-12)


@pytest.mark.parametrize("belt", [None, Belt(0.2, 0.25)])
def test_a_warped_chart_has_the_same_points_elsewhere(belt: Belt | None) -> None:
    plain = Chart((-0.25, 0.1, 0.05), belt)
    warped, uv = replace(plain, warp=ring_warp(OPEN)), inner(OPEN)
    radius = np.linspace(0.1, 0.3, len(uv))
    points = warped.points(uv, radius)
    np.testing.assert_allclose(points, plain.points(warped.angles(uv), radius), atol=1e-12)
    back, found = warped.uv(points)
    np.testing.assert_allclose(found, radius, atol=1e-9)
    np.testing.assert_allclose(back, uv, atol=4e-3)
    assert (warped.below(uv) == plain.below(warped.angles(uv))).all()


@pytest.mark.parametrize("value", [np.nan, 0.75, -0.95])
def test_what_leads_out_of_the_window_is_no_warp(value: float) -> None:
    warp = ring_warp(OPEN)
    assert warp.sound
    for name in ("forth", "back"):
        grid = getattr(warp, name).copy()
        grid[3, 4, 0] = value
        assert not replace(warp, **{name: grid}).sound
    assert not Warp(OPEN, warp.forth[:1], warp.back[:1]).sound
