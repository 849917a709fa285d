"""Texels have about the same area: of a sphere in closed form, and of a wall up to the most that counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window, window_uv
from facefolds_core.training.explicit.texel_density import DENSITIES, with_even_texels

WINDOW: Window = (-0.7, 0.7, -1.0, 1.0)
SHAPE = (120, 160)
THERE = np.ones(SHAPE, bool)


def areas(chart: Chart, radius: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the cells of a grid over (u, v), on a surface with a radius."""
    uv = window_uv(WINDOW, *SHAPE)
    points = chart.points(uv, np.broadcast_to(radius, SHAPE))
    return np.linalg.norm(np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1)), axis=-1)[4:-4, 4:-4]


def test_cells_of_a_sphere_are_alike() -> None:
    plain = Chart((-0.25, 0.0, 0.0))
    even = with_even_texels(plain, WINDOW, np.full(SHAPE, 0.3), THERE)
    before, after = areas(plain, 0.3), areas(even, 0.3)
    assert before.max() > 1.9 * before.min()  # meridians converge
    assert after.max() < 1.08 * after.min()


def test_a_wall_gets_more_texels_and_what_is_empty_fewer() -> None:
    plain, radii, there = Chart((-0.25, 0.0, 0.0)), np.full(SHAPE, 0.3), THERE.copy()
    radii[60:] = 0.25
    there[:, :20] = False
    even = with_even_texels(plain, WINDOW, radii, there)
    assert even.warp is not None
    (uu, uv), (vu, vv) = (np.gradient(even.warp.forth[..., k]) for k in range(2))
    room = uv * vu - uu * vv
    assert 1.2 * room[30:50, 60:].max() < room[58:61, 100].max() < DENSITIES[1] / DENSITIES[0] * room[30:50, 60:].min()
    assert room[30:50, :15].max() < 0.7 * room[30:50, 60:].min()
