"""Tracks of a head: quaternions against rotations, cameras, times between frames, robust alignment."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.geometry.quaternions import quaternion, rotation
from facefolds_core.geometry.track import Track, mean_rotation, rigid_motion, slerp
from tests.scenes import look_at_origin


def about(axis: tuple[float, float, float], degrees: float) -> NDArray[np.float64]:
    """(3, 3) by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K, angle = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.radians(degrees)
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


TURNS = [about((0, 0, 1), 0), about((0, 0, 1), 10), about((1, 2, -1), 30)]
SHIFTS = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.2, -0.3]]


@pytest.mark.parametrize("degrees", [0, 1e-6, 35, 179.999, 180])
def test_a_quaternion_is_its_rotation(degrees: float) -> None:
    R = about((0.3, -1, 2), degrees)
    assert np.abs(rotation(quaternion(R)) - R).max() < 1e-9


def test_halfway_between_frames_is_half_the_turn_and_half_the_shift() -> None:
    pose = Track.of(TURNS, SHIFTS).at(0.5)
    assert np.abs(pose.rotation - about((0, 0, 1), 5)).max() < 1e-9
    assert pose.translation == pytest.approx([0.05, 0, 0])
    # Along the shorter arc.
    q = quaternion(about((0, 1, 0), 40))
    assert np.abs(rotation(slerp(q, -quaternion(about((0, 1, 0), 60)), 0.5)) - about((0, 1, 0), 50)).max() < 1e-9


def test_times_beyond_the_ends_are_held_and_the_nearest_frame_turns_least() -> None:
    track = Track.of(TURNS, SHIFTS)
    assert np.array_equal(track.at(7.5).translation, track.at(2).translation)
    assert np.array_equal(track.at(-1).translation, track.at(0).translation)
    assert Track.of(TURNS[::-1], SHIFTS[::-1]).nearest() == 2  # the frame that turns least


def test_a_camera_sees_a_point_of_the_head_where_it_is_in_the_world() -> None:
    track, camera = Track.of(TURNS, SHIFTS), look_at_origin("a", 20, 5, 64)
    point = np.array([[0.1, 0.02, 0.05]])
    expected = camera.project(track.at(2).apply(point))[0]
    assert track.camera(camera, 2).project(point)[0] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("change", "says"),
    [(lambda q: q[:2], "frames"), (lambda q: q * 1.01, "unit length"), (lambda q: q * np.nan, "not finite")],
)
def test_a_track_says_what_is_wrong(change: object, says: str) -> None:
    track = Track.of(TURNS, SHIFTS)
    assert track.problems(3) == []
    assert says in Track(change(track.quaternions), track.translations).problems(3)[0]  # type: ignore[operator]


def test_the_mean_of_opposite_turns_is_none() -> None:
    assert np.abs(mean_rotation([about((0, 1, 0), 20), about((0, 1, 0), -20)]) - np.eye(3)).max() < 1e-12


def test_alignment_does_not_follow_what_moves_by_itself() -> None:
    """A fifth of the points, a jaw, moves by a tenth of the head."""
    points = np.random.default_rng(0).normal(size=(300, 3))
    R, t = about((1, 0.5, 0), 25), np.array([0.3, -0.2, 1.0])
    moved = points @ R.T + t
    moved[:60] += [0, -0.3, 0.1]
    found, shift = rigid_motion(points, moved)
    cosine = (np.trace(found @ R.T) - 1) / 2
    assert np.degrees(np.arccos(min(cosine, 1.0))) < 0.1  # least squares: 0.6
    assert np.abs(shift - t).max() < 0.01  # least squares: 0.06
