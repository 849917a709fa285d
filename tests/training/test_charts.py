"""Which chart is chosen: a belt where a neck stands in a collar, the plain sphere where that holds all."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.params import ExplicitParams
from facefolds_core.subject import outline
from facefolds_core.subject.volume import Volume
from facefolds_core.training.explicit.fit import filmed_around, fit_window
from tests.scenes import look_at_origin

PARAMS = ExplicitParams()
START = PARAMS.start.model_copy(update={"centres": (-0.15, -0.2, -0.25), "belts": (10.0,)})
AXIS, VOXEL = -0.2, 0.0125
HEAD, NECK, RIM, ROOT, EDGE, FLOOR = 0.16, 0.09, 0.3, -0.2, -0.3, -0.36
"""A ball 0.05 above the origin, a neck down to ROOT, and a collar that slopes from there to its RIM at EDGE."""

Array = NDArray[np.float64]


def volume_of(inside: Array) -> Volume:
    """From depths below the surface, units, on a grid over +-0.45."""
    grid = np.zeros((*inside.shape, 4), np.float32)
    grid[..., 0] = np.logaddexp(0, (inside / VOXEL * 10).clip(-12, 12))
    return Volume(grid, np.full(3, -0.45), VOXEL)


def nodes() -> tuple[Array, Array]:
    """Of the grid: distance from the axis, and height."""
    axis = np.linspace(-0.45, 0.45, 73)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.hypot(x - AXIS, y), z


@pytest.fixture(scope="module")
def bust() -> Volume:
    flat, z = nodes()
    head = HEAD - np.hypot(flat, z - 0.05)
    neck = np.minimum(NECK - flat, -z)
    slope = (EDGE - ROOT) / (RIM - NECK)
    under_the_top = (ROOT + slope * (flat - NECK) - z) / math.hypot(1, slope)
    collar = np.minimum.reduce([under_the_top, RIM - flat, z - FLOOR])
    return volume_of(np.maximum.reduce([head, neck, collar]))


def around(flat: Array, z: Array) -> Array:
    """(P, 3) before the axis, at these distances and heights."""
    azimuth = np.random.default_rng(0).uniform(-1.4, 1.4, len(flat))
    return np.stack([AXIS + flat * np.cos(azimuth), flat * np.sin(azimuth), z], -1)


def seen_of_the_bust() -> dict[str, Array]:
    """What cameras before it see."""
    t = np.linspace(0.03, 0.97, 400)
    tilt = -1.0 + 2.4 * t
    return {
        "head": around(HEAD * np.cos(tilt), 0.05 + HEAD * np.sin(tilt)),
        "neck": around(np.full(400, NECK), ROOT + 0.1 * t),
        "collar": around(NECK + (RIM - NECK) * t, ROOT + (EDGE - ROOT) * t),
        "rim": around(np.full(400, RIM), FLOOR + (EDGE - FLOOR) * t),
    }


def test_a_neck_in_a_collar_needs_a_belt(bust: Volume) -> None:
    parts = seen_of_the_bust()
    sphere, belted = Chart((AXIS, 0.0, 0.0)), Chart((AXIS, 0.0, 0.0), Belt(math.radians(10), 0.25))
    lost = {name: [outline.lost(bust, c, part, START).mean() for c in (sphere, belted)] for name, part in parts.items()}
    assert lost["neck"][0] > 0.5
    assert lost["neck"][1] < 0.3
    assert max(lost["head"]) < 0.1 and lost["collar"][1] < 0.15
    chosen, losses = outline.choose_chart(bust, list(parts.values()), START)
    assert chosen.belt is not None and math.degrees(chosen.belt.elevation) == pytest.approx(10)
    plain = min(loss for chart, loss in losses.items() if chart.belt is None)
    assert losses[chosen] < 0.6 * plain
    assert len(losses) == 2 * len(START.centres)


def ball() -> tuple[Volume, Array]:
    """Radius 0.25 around (-0.2, 0, 0), and points of its front."""
    flat, z = nodes()
    n = np.random.default_rng(0).normal(size=(3000, 3))
    points = 0.25 * n / np.linalg.norm(n, axis=1, keepdims=True)
    front = (points[:, 0] > 0) & (np.abs(points[:, 2]) < 0.2)
    return volume_of(0.25 - np.hypot(flat, z)), points[front] + np.array([AXIS, 0, 0])


def test_a_ball_keeps_the_sphere_farthest_back() -> None:
    volume, points = ball()
    chosen, losses = outline.choose_chart(volume, [points], START)
    assert chosen == Chart((-0.25, 0.0, 0.0))
    assert losses[chosen] < 0.02
    alike = [chart for chart, loss in losses.items() if loss <= min(losses.values()) + START.centre_tie]
    assert any(chart.belt is not None and chart.centre == chosen.centre for chart in alike)  # it was a tie
    # A radian below a belt is as long as one around it.
    girths = {chart.centre[0]: chart.belt.girth for chart in losses if chart.belt is not None}
    assert girths[-0.2] == pytest.approx(0.25)
    _, plain = outline.choose_chart(volume, [points], START.model_copy(update={"belts": ()}))
    assert list(plain) == [Chart((x, 0.0, 0.0)) for x in START.centres]


def test_a_chart_that_takes_much_from_one_camera_does_not_win(monkeypatch: pytest.MonkeyPatch) -> None:
    """0.1 % of all that is seen is a tenth of what one of a hundred cameras sees."""
    volume, points = ball()
    views = np.array_split(np.tile(points, (4, 1)), 100)

    def gone(volume: Volume, chart: Chart, points: Array, *_: object) -> np.ndarray:
        few = np.zeros(len(points), bool)
        few[: int(0.001 * len(points)) if chart.centre[0] < -0.2 else 0] = True
        return few

    monkeypatch.setattr(outline, "lost", gone)
    assert outline.choose_chart(volume, views, START)[0].centre[0] == -0.2
    assert outline.choose_chart(volume, [np.concatenate(views)], START)[0].centre[0] == START.centres[-1]


def test_surface_nearer_to_the_centre_than_layers_may_lie_is_lost() -> None:
    flat, z = nodes()
    near = outline.MIN_RADIUS - 0.01
    points = around(near * np.ones(50), np.zeros(50))
    small = volume_of(near - np.hypot(flat, z))
    within, behind = (Chart((x, 0.0, 0.0)) for x in (AXIS, AXIS - 0.2))
    assert outline.lost(small, within, points, START).all()
    assert outline.lost(small, behind, points, START).mean() < 0.5


def test_the_profile_of_a_neck_is_its_radius(bust: Volume) -> None:
    chart = Chart((AXIS, 0.0, 0.0), Belt(0.0, 0.25))
    slides = np.array([0.13, 0.15, 0.17])
    uv = np.stack([-2 / math.pi * slides / 0.25, [-1.2, 0.0, 0.7]], -1)
    seen = outline.profile(bust, chart, uv, PARAMS.start.subject_opacity)
    assert seen.radius == pytest.approx(np.full(3, NECK), abs=0.01)


def test_windows_reach_behind_the_ears_and_below_the_pole_where_something_is_seen(bust: Volume) -> None:
    chart = Chart((AXIS, 0.0, 0.0), Belt(math.radians(10), 0.25))
    whole = fit_window(bust, chart, np.concatenate(list(seen_of_the_bust().values())), None, START)
    assert -START.column_limit <= whole[0] < -0.8  # u of the floor: -0.86
    ears = chart.points(np.array([[0.0, -1.3], [0.0, 1.3]]), np.full(2, HEAD))
    u0, u1, v0, v1 = fit_window(bust, chart, ears, None, START)
    assert -START.azimuth_limit <= v0 < -1.2 and 1.2 < v1 <= START.azimuth_limit
    assert -0.3 < u0 < u1 < 0.3
    back = chart.points(np.array([[0.0, -1.99], [0.0, 1.99]]), np.full(2, HEAD))
    assert fit_window(bust, chart, back, None, START, around=True)[2:] == (-2, 2)  # one line


def test_one_point_seen_behind_the_subject_widens_no_window(bust: Volume) -> None:
    chart = Chart((AXIS, 0.0, 0.0), Belt(math.radians(10), 0.25))
    face = chart.points(np.random.default_rng(0).uniform(-0.4, 0.4, (4000, 2)), np.full(4000, HEAD))
    stray = chart.points(np.array([[0.0, -1.3]]), np.full(1, HEAD))
    alone, both = (fit_window(bust, chart, points, None, START) for points in (face, np.vstack([face, stray])))
    assert both == alone and alone[2] > -0.6


def test_a_subject_beyond_every_window_is_said(bust: Volume) -> None:
    behind = np.array([[AXIS - 0.3, 0.001, 0.0], [AXIS - 0.3, -0.001, 0.0]])
    with pytest.raises(UserError, match="has a place"):
        fit_window(bust, Chart((AXIS, 0.0, 0.0)), behind, None, START)


def test_all_around_is_what_leaves_no_wide_gap() -> None:
    def ring(count: int) -> list[Camera]:
        return [look_at_origin(f"c{k}", 360 / 8 * k, 0, 16) for k in range(count)]

    assert filmed_around(ring(8)) and not filmed_around(ring(7)) and not filmed_around([])


def test_the_back_of_a_tracked_head_widens_no_window(bust: Volume) -> None:
    chart = Chart((AXIS, 0.0, 0.0))
    face = chart.points(np.random.default_rng(0).uniform(-0.4, 0.4, (400, 2)), np.full(400, HEAD))
    ball = trimesh.creation.icosphere(3, HEAD)
    vertices = np.asarray(ball.vertices)[None] + np.array(chart.centre)
    alone, tracked = (fit_window(bust, chart, face, mesh, START) for mesh in (None, vertices))
    assert alone[3] < 0.6
    assert -1.1 < tracked[2] < -0.9 and 0.9 < tracked[3] < 1.1  # straight sideways, and the margin
