"""The actor's take: what loops, what she says, and that she blinks as people do."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.captures.actor.motion import BLINK, EXCERPT, GAZE_X, JAW, PERIOD, PUCKER, head_pose, pose_at

TIMES = np.arange(0, PERIOD, 0.005)


@pytest.mark.parametrize("end", [EXCERPT, PERIOD])
def test_the_take_and_its_first_words_loop(end: float) -> None:
    assert pose_at(end - 1e-9) == pytest.approx(pose_at(0.0), abs=0.02)  # of the mouth; all else stands still
    for at_end, at_begin in zip(head_pose(end - 1e-9, 0.1), head_pose(0.0, 0.1), strict=True):
        assert at_end == pytest.approx(at_begin, abs=1e-6)
    assert pose_at(3 * PERIOD + 0.3) == pytest.approx(pose_at(0.3), abs=1e-6)


def test_two_blinks_that_shut_faster_than_they_open() -> None:
    blink = np.array([pose_at(t)[BLINK] for t in TIMES])
    falls, rises = np.diff(blink) > 0, np.diff(blink) < 0
    shut = np.flatnonzero(np.diff((blink > 0.99).astype(int)) == 1)
    assert len(shut) == 2 and np.diff(TIMES[shut])[0] > 2
    assert 0.05 < falls.sum() * 0.005 / 2 < 0.10 < rises.sum() * 0.005 / 2 < 0.25


def test_lips_shut_for_m_and_are_round_for_o() -> None:
    assert pose_at(3.15)[JAW] < 0.1 < 0.5 < min(pose_at(3.02)[JAW], pose_at(3.40)[JAW])
    assert pose_at(2.62)[PUCKER] > 0.8 and pose_at(1.80)[PUCKER] < 0.2


def test_sounds_blend() -> None:
    """No jumps: the mouth takes at least 50 ms from shut to open."""
    jaw = np.array([pose_at(t)[JAW] for t in TIMES])
    assert np.abs(np.diff(jaw)).max() < 0.1


def test_eyes_leap() -> None:
    gaze = np.array([pose_at(t)[GAZE_X] for t in TIMES])
    still = np.diff(gaze) == 0
    assert still.mean() > 0.9 and np.ptp(gaze) > 0.2


def test_the_neck_stands_while_the_head_turns() -> None:
    rotation, translation = head_pose(0.6, 0.1)
    base = np.array([0.0, -150.0, -40.0])
    assert rotation @ base + translation == pytest.approx(np.diag([1.0, -1.0, -1.0]) @ base + [0, 0, 1000], abs=1e-9)
    assert np.degrees(np.arccos((np.trace(rotation @ np.diag([1.0, -1.0, -1.0])) - 1) / 2)) > 4
