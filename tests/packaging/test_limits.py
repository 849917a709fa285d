"""From where a picture is good: veils in pictures, ranges of directions, and a cap that is torn at one side."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from facefolds_core.asset.filmed import FREE
from facefolds_core.asset.manifest_extras import FilmedView
from facefolds_core.packaging.limits import STEP, directions, good_view, largest_range, worst_veil
from tests.assets import cap_mesh

FILMED = FilmedView(azimuth=(-40, 40), elevation=(-12, 12))
WINDOW = (-1, 1, -2, 2)
"""Radians: the cap goes round to 115 degrees at each side."""
SHAPE = (64, 256)
TORN = 212
"""First column of texels that are torn: 75 degrees to the left, hardly seen from before."""


def cap(alpha: np.ndarray) -> Any:
    """One layer, opaque but for a part."""
    texture = np.full((*SHAPE, 4), 200, np.uint8)
    texture[..., 3] = alpha
    return SimpleNamespace(layers=[cap_mesh(0.4, 40, WINDOW)], track=None, num_frames=1, frame=lambda k: [texture])


def test_a_veil_counts_where_it_is_thickest() -> None:
    alpha = np.zeros((80, 80))
    alpha[20:60, 20:60] = 1
    assert worst_veil(alpha) == 0
    alpha[40:60, 40:60] = 0.5
    assert worst_veil(alpha) == pytest.approx(1)
    assert worst_veil(np.zeros((80, 80))) == 0


def test_directions_go_a_little_beyond_the_cameras() -> None:
    found = directions(-40, 40)
    assert found[[0, -1]].tolist() == [-40 - FREE, 40 + FREE]
    assert np.diff(found).max() <= STEP
    assert directions(7, 7).tolist() == [7 - FREE, 7, 7 + FREE]


def test_the_largest_range_holds_the_front() -> None:
    good = np.ones((4, 8), bool)
    good[0, 4] = False
    assert largest_range(good, (1, 2)) == ((1, 3), (0, 7))
    good[1:, 5] = False
    assert largest_range(good, (1, 2)) == ((1, 3), (0, 4))
    assert largest_range(good, (1, 5)) is None


def test_a_whole_cap_is_good_from_everywhere() -> None:
    found = good_view(cap(np.full(SHAPE, 255)), FILMED)
    assert (found.azimuth, found.elevation) == ((-40 - FREE, 40 + FREE), (-12 - FREE, 12 + FREE))


def test_a_torn_side_bounds_that_side() -> None:
    alpha = np.full(SHAPE, 255)
    alpha[:, TORN:] = np.random.default_rng(0).choice([0, 90, 255], (SHAPE[0], SHAPE[1] - TORN))
    found = good_view(cap(alpha), FILMED)
    right, left = found.azimuth
    assert right == -40 - FREE and 0 < left < FILMED.azimuth[1]
    assert found.elevation == (-12 - FREE, 12 + FREE)
