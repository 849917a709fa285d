"""Gaussians of other frames: those change that the pictures contradict."""

from __future__ import annotations

import numpy as np

from facefolds_core.subject.frames import RIDE, changed_to, mean_errors, ridden, targets_of
from facefolds_core.subject.splats import COLOUR, MEAN, Splats
from tests.scenes import look_at_origin
from tests.subject.splats import drawn, some, some_splats

CAMERAS = [look_at_origin(f"c{a}", a, 5, 48) for a in (-40, -15, 15, 40)]


def test_nothing_changes_before_its_own_pictures() -> None:
    splats = some()
    targets = targets_of(CAMERAS, drawn(splats, CAMERAS))
    errors = mean_errors(splats, targets)
    assert errors.max() < 0.05  # colours above 1 are clipped in pictures
    assert changed_to(splats, errors, targets, 0) is splats


def test_what_another_colour_contradicts_follows_and_the_rest_stays_bit_for_bit() -> None:
    splats, other = some(), some_splats(300)
    upper = splats.means[:, 2] > 0.1
    other[upper, COLOUR] = 1 - other[upper, COLOUR]
    before, after = (targets_of(CAMERAS, drawn(one, CAMERAS)) for one in (splats, Splats(other, splats.background)))
    usual = mean_errors(splats, before)
    found = changed_to(splats, usual, after, 0)
    still = (found.values == splats.values).all(1)
    assert still[splats.means[:, 2] < -0.15].mean() > 0.9
    assert (~still[upper]).sum() > 10
    assert mean_errors(found, after)[upper].mean() < 0.6 * mean_errors(splats, after)[upper].mean()


def test_gaussians_ride_on_the_nearest_vertex_and_what_is_far_off_stays() -> None:
    splats = some(3)
    vertices = np.array([[0.0, 0, 0], [1.0, 0, 0]])
    splats.values[:, MEAN] = [[0, 0, 0], [1, RIDE / 2, 0], [0, 2 * RIDE, 0]]
    moved = ridden(splats, vertices, np.array([[0, 0, 0.1], [1.2, 0, 0]]))
    np.testing.assert_allclose(moved.means - splats.means, [[0, 0, 0.1], [0.1, 0, 0], [0, 0, 0]], atol=1e-6)
    np.testing.assert_array_equal(moved.values[:, MEAN.stop :], splats.values[:, MEAN.stop :])
