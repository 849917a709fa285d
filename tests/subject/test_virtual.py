"""Cameras that nobody filmed with."""

from __future__ import annotations

import math

import numpy as np
import pytest

from facefolds_core.subject.splats import Splats
from facefolds_core.subject.virtual import FEW, GAP, VIEWS, virtual_cameras
from tests.scenes import look_at_origin
from tests.subject.splats import some_splats

SUBJECT = Splats(some_splats(400), np.zeros(3, np.float32))


def directions(cameras) -> np.ndarray:  # type: ignore[no-untyped-def]
    centres = np.array([camera.centre for camera in cameras])
    return centres / np.linalg.norm(centres, axis=1, keepdims=True)


def degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(a @ b.T, -1, 1)))


def test_wide_gaps_are_filled_and_nothing_beyond_the_cameras() -> None:
    real = [look_at_origin(f"c{a}{e}", a, e, 48) for a in (-45, 0, 45) for e in (-10, 15)]
    found = virtual_cameras(real, SUBJECT, (48, 64))
    assert 0 < len(found) <= VIEWS - len(real)
    apart = degrees(directions(found), directions(real))
    assert apart.min() > 0.8 * GAP  # the subject's middle is not quite the origin
    azimuths = np.degrees(np.arctan2(directions(found)[:, 1], directions(found)[:, 0]))
    assert np.abs(azimuths).max() < 46
    between = directions([look_at_origin("between", 22.5, 0, 48)])
    assert degrees(between, np.concatenate([directions(real), directions(found)])).min() < GAP


def test_where_there_are_many_cameras_or_no_gaps_there_is_none() -> None:
    many = [look_at_origin(f"c{a}", a, 20 * math.sin(a), 48) for a in np.linspace(-60, 60, FEW + 1)]
    assert not virtual_cameras(many, SUBJECT, (48, 48))
    close = [look_at_origin(f"c{a}{e}", a, e, 48) for a in (-10, 0, 10) for e in (-10, 0, 10)]
    assert not virtual_cameras(close, SUBJECT, (48, 48))
    assert not virtual_cameras(close[:2], SUBJECT, (48, 48))


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
