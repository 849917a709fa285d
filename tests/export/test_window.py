"""The automatic window keeps all that a training ray can see, and no more than a margin beside."""

from __future__ import annotations

import numpy as np
import pytest
from torch import Tensor

from facefolds_core.export.window import MAX_CHANGE, _crossings, visible_window
from facefolds_core.geometry.sphere_uv import FULL_WINDOW
from tests.ellipsoids import Composited, Ellipsoids
from tests.scenes import look_at_origin

RIG = [look_at_origin(f"cam{i}", azimuth, 10 * (-1) ** i, 120) for i, azimuth in enumerate((-40, -15, 15, 40))]


@pytest.mark.parametrize("patch", [0.3, 0.6])
def test_no_ray_loses_more_than_the_bound(patch: float, monkeypatch: pytest.MonkeyPatch) -> None:
    model = Ellipsoids(patch=patch)
    monkeypatch.setattr("facefolds_core.export.window.RAYS_PER_CAMERA", 900)
    u0, u1, v0, v1 = visible_window(model, RIG)
    for camera in RIG:  # every pixel, not only the lattice that the window was made from
        uv, weights, hit, _ = _crossings(model, camera, 1, [1])
        outside = (uv[..., 0] < u0) | (uv[..., 0] > u1) | (uv[..., 1] < v0) | (uv[..., 1] > v1)
        assert np.where(outside & hit, weights, 0).sum(-1).max() <= MAX_CHANGE


def test_the_window_fits_the_scene() -> None:
    u0, u1, v0, v1 = visible_window(Ellipsoids(patch=0.3), RIG)
    assert -0.4 < u0 < -0.29
    assert -0.4 < v0 < -0.29
    assert 0.29 < u1 < 0.4
    assert 0.29 < v1 < 0.4


@pytest.mark.parametrize("patch", [1e-6, 0.6])
def test_no_window_is_larger_than_the_models(patch: float) -> None:
    """All of it is kept of one that cannot be seen."""
    own = (-0.1, 0.2, -0.15, 0.25)
    assert visible_window(Ellipsoids(patch=patch, window=own), RIG[:2]) == own
    assert visible_window(Ellipsoids(patch=1e-6), RIG[:1]) == FULL_WINDOW


def test_the_first_the_middle_and_the_last_frame_are_looked_at() -> None:
    asked = set[float]()

    class Listening(Ellipsoids):
        def render(self, origins: Tensor, directions: Tensor, time: float, view_effects: bool) -> Composited:
            asked.add(time)
            return super().render(origins, directions, time, view_effects)

    visible_window(Listening(num_frames=20), RIG[:1])
    assert asked == {0, 10, 19}
