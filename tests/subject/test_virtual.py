"""Cameras that nobody filmed with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.subject.splats import Splats
from facefolds_core.subject.virtual import FEW, GAP, VIEWS, seen_by_few, virtual_cameras
from tests.scenes import look_at_origin
from tests.subject.splats import some

SUBJECT = some(400)


def slab() -> Splats:
    """Opaque Gaussians on two squares, 0.2 units apart along x."""
    places = np.stack(np.meshgrid([-0.1, 0.1], *2 * [np.linspace(-0.2, 0.2, 31)], indexing="ij"), -1).reshape(-1, 3)
    found = some(len(places))
    values = found.values
    values[:, :3], values[:, 3:6], values[:, 6:11] = places, np.log(0.012), [1, 0, 0, 0, 5]
    return found


SLAB = slab()


def directions(cameras) -> np.ndarray:  # type: ignore[no-untyped-def]
    centres = np.array([camera.centre for camera in cameras])
    return centres / np.linalg.norm(centres, axis=1, keepdims=True)


def degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(a @ b.T, -1, 1)))


def test_wide_gaps_are_filled_and_nothing_beyond_the_cameras() -> None:
    real = [look_at_origin(f"c{a}{e}", a, e, 48) for a in (-45, 0, 45) for e in (-10, 15)]
    found = virtual_cameras(real, SUBJECT, (48, 64))
    assert 0 < len(found) <= VIEWS
    apart = degrees(directions(found), directions(real))
    assert apart.min() > 0.8 * GAP  # the subject's middle is not quite the origin
    azimuths = np.degrees(np.arctan2(directions(found)[:, 1], directions(found)[:, 0]))
    assert np.abs(azimuths).max() < 46
    between = directions([look_at_origin("between", 22.5, 0, 48)])
    assert degrees(between, np.concatenate([directions(real), directions(found)])).min() < GAP


@pytest.mark.parametrize("farthest", [80, 130])
def test_cameras_beside_the_subject_have_no_views_above_or_below_all_of_them(farthest: int) -> None:
    """So far from the middle one a central projection has no hull, and that of angles reaches over the head."""
    azimuths = np.linspace(-farthest, farthest, 7)
    real = [look_at_origin(f"c{a:.0f}{e}", a, e, 48) for a in azimuths for e in (-25, 25)]
    found = directions(virtual_cameras(real, SUBJECT, (48, 48)))
    elevations, azimuths = np.degrees(np.arcsin(found[:, 2])), np.degrees(np.arctan2(found[:, 1], found[:, 0]))
    assert len(found) > 8
    assert np.abs(elevations).max() < 36
    assert np.abs(azimuths).max() < farthest + 2


@pytest.mark.parametrize("azimuths", [(-60, -20, 20, 60), tuple(range(0, 360, 45))], ids=["in a row", "all around"])
def test_cameras_at_one_height_have_views_between_neighbours(azimuths: tuple[int, ...]) -> None:
    real = [look_at_origin(f"c{a}", a, 0, 48) for a in azimuths]
    found = directions(virtual_cameras(real, SUBJECT, (48, 48)))
    halfway = directions([look_at_origin("", a + 0.5 * (azimuths[1] - azimuths[0]), 0, 48) for a in azimuths[:-1]])
    assert degrees(halfway, found).min(1).max() < 10  # the subject's middle is not quite the origin
    assert np.abs(np.degrees(np.arcsin(found[:, 2]))).max() < 11


def test_where_there_are_no_gaps_or_too_few_cameras_to_stand_between_there_is_none() -> None:
    close = [look_at_origin(f"c{a}{e}", a, e, 48) for a in (-10, 0, 10) for e in (-10, 0, 10)]
    assert not virtual_cameras(close, SUBJECT, (48, 48))
    apart = [look_at_origin(f"c{a}", a, 0, 48) for a in (-40, 40)]
    assert not virtual_cameras(apart, SUBJECT, (48, 48))


def test_places_are_asked_for_that_few_cameras_see() -> None:
    """Right of the subject's middle, where one camera's picture ends; all around are as many as are many."""
    view = look_at_origin("virtual", 0, 0, 48)
    many = [look_at_origin(f"c{n}", n, 0, 48) for n in range(FEW)]
    assert not seen_by_few([view], many, SLAB).any()
    K = many[0].K.copy()
    K[0, 2] += 24  # its left half is what it sees: the subject's right lies beyond its picture
    half = replace(many[0], K=K)
    found = seen_by_few([view], [half, *many[1:]], SLAB)[0]
    assert found[:, 30:].all() and not found[:, :18].any()
    assert seen_by_few([view], many[1:], SLAB).all()


def test_what_lies_behind_the_subject_is_not_seen_from_before_it() -> None:
    view = look_at_origin("virtual", 180, 0, 48)
    before = [look_at_origin(f"c{n}", n, 0, 48) for n in range(FEW)]
    assert seen_by_few([view], before, SLAB).all()
    assert not seen_by_few([view], [view] * FEW, SLAB).any()


@pytest.mark.parametrize("size", [(48, 64), (64, 48)])
def test_they_are_upright_and_the_whole_subject_is_in_their_pictures(size: tuple[int, int]) -> None:
    real = [look_at_origin(f"c{a}{e}", a, e, 48) for a in (-30, 30) for e in (-20, 20)]
    found = virtual_cameras(real, SUBJECT, size)
    assert found
    for camera in found:
        np.testing.assert_allclose(camera.rotation @ camera.rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(camera.rotation) > 0 and camera.rotation[1, 2] < 0
        places, depth = camera.project(SUBJECT.means.astype(float))
        inside = (depth > 0) & (places >= 0).all(1) & (places <= size).all(1)
        assert inside.mean() > 0.97 and (camera.width, camera.height) == size
