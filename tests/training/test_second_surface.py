"""Layers beneath an overhang: a ball under the brim of a hat, seen from below."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.chart import Chart
from facefolds_core.subject.outline import profile, window_uv
from facefolds_core.subject.volume import Volume
from facefolds_core.training.explicit.second_surface import (
    GAP,
    HALFWIDTH,
    LAYERS,
    second_layers,
    second_surface,
    shells_of_both,
)
from tests.scenes import look_at_origin

CHART, WINDOW = Chart((-0.05, 0.0, 0.0)), (-0.6, 0.6, -0.6, 0.6)
BALL, BRIM, EDGE = 0.15, (0.2, 0.26), np.radians(20)
"""Radius of the ball; radii between which the brim lies, and the elevation of its lower edge, all about c."""
VOXEL = 0.0075
NODES = window_uv(WINDOW, 64, 64)
ELEVATION = NODES[..., 0] * np.pi / 2

Array = NDArray[np.float64]


def volume(brim: bool) -> Volume:
    axis = np.arange(-0.35, 0.351, VOXEL)
    x, y, z = np.meshgrid(axis + 0.05, axis, axis, indexing="ij")
    radius, elevation = np.sqrt(x * x + y * y + z * z), np.arctan2(z, np.hypot(x, y))
    inside = BALL - radius
    if brim:
        hat = np.minimum.reduce([radius - BRIM[0], BRIM[1] - radius, radius * (elevation - EDGE)])
        inside = np.maximum(inside, hat)
    grid = np.zeros((*inside.shape, 4), np.float32)
    grid[..., 0] = 3 * np.clip(0.5 + inside / VOXEL, 0, 1)
    grid[..., 1] = np.where(radius < 0.18, 1.0, 0.0)  # the ball is red
    return Volume(grid, np.full(3, -0.35), VOXEL)


def cameras() -> list[Camera]:
    """Before the ball, level with it and below."""
    return [look_at_origin("one", azimuth, elevation, 160) for elevation in (0, -30) for azimuth in (-20, 0, 20)]


def first(held: Volume) -> Array:
    return profile(held, CHART, NODES, 0.5).radius


def test_what_lies_beneath_a_brim_is_found_where_cameras_see_it() -> None:
    held = volume(brim=True)
    found = second_surface(held, CHART, WINDOW, first(held) - HALFWIDTH, cameras())
    above = (ELEVATION > EDGE + 0.08) & (ELEVATION < EDGE + 0.16) & (np.abs(NODES[..., 1]) < 0.3)
    assert (found[above] > 0).mean() > 0.95
    off = np.abs(found[above & (found > 0)] - BALL)
    assert np.quantile(off, 0.9) < VOXEL  # beside the edge the brim's underside is near
    assert not found[ELEVATION < EDGE - 0.2].any()
    assert not found[ELEVATION > EDGE + 0.7].any()  # no camera looks so far up beneath it


def test_a_ball_has_no_second_surface() -> None:
    held = volume(brim=False)
    assert not second_surface(held, CHART, WINDOW, first(held) - HALFWIDTH, cameras()).any()


def test_second_layers_lie_beneath_the_first() -> None:
    middle = np.array([[0.0, 0.15, 0.2]])
    inner = np.array([[0.2, 0.2, 0.2]])
    radii = second_layers(middle, inner)
    assert radii.shape == (1, 3, LAYERS)
    assert not radii[0, 0].any()
    np.testing.assert_allclose(radii[0, 1, [0, -1]], [0.15 + HALFWIDTH, 0.15 - HALFWIDTH], atol=1e-6)
    assert radii[0, 2, 0] == pytest.approx(0.2 - GAP, abs=1e-6)
    assert (np.diff(radii[0, 1:]) < 0).all()


def test_each_surface_begins_with_what_lies_there() -> None:
    """The brim is black and the ball beneath it red; where there is no second surface it has no opacity."""
    held = volume(brim=True)
    radii = np.concatenate([np.full((2, 3), 0.255), np.array([[BALL] * 2, [np.nan] * 2])], 1)
    radii[:, :3] += [0.005, 0.0, -0.005]
    radii[0, 3:] += [0.005, -0.005]
    uv = np.full((2, 2), [0.35, 0.0])
    opacity, rgb = shells_of_both(held, CHART, uv, radii, 3)
    assert 1 - np.prod(1 - opacity[0, 3:]) > 0.5
    assert not opacity[1, 3:].any()
    shown = (opacity[0] > 0.05).nonzero()[0]
    assert (rgb[0, shown[shown >= 3], 0] > 0.5).all()
    assert (rgb[0, shown[shown < 3], 0] < 0.1).all()
    np.testing.assert_array_equal(opacity[0, :3], opacity[1, :3])
