"""The actor's performance: a periodic function of time that says how eyes, jaw, brows and lip corners stand."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

PERIOD = 12 / 30
"""Seconds after which the performance repeats: twelve frames at thirty a second."""

BLINK, JAW, BROW, SMILE, GAZE_X, GAZE_Y, NOSE, BALL = range(8)
"""Places in a pose; the last two are the subject's shape, still in time (`render.ActorOptions`)."""


def _bump(phase: float, centre: float, halfwidth: float) -> float:
    """A raised cosine on the circle of phases: 1 at `centre`, 0 from `halfwidth` on."""
    offset = (phase - centre + 0.5) % 1.0 - 0.5
    return 0.5 + 0.5 * math.cos(math.pi * offset / halfwidth) if abs(offset) < halfwidth else 0.0


def pose_at(time: float) -> NDArray[np.float64]:
    """The pose at a time in seconds: (8,) blink, jaw, brow and smile in [0, 1], gaze right and up in radians, 0, 0.

    Phase 0 is a calm look with a slight smile; the jaw opens widest at 0.33 with raised brows, the eyes are shut at
    0.67, the smile is widest at 0.83.
    """
    phase = (time / PERIOD) % 1.0
    pose = np.zeros(8)
    pose[BLINK] = _bump(phase, 8 / 12, 0.15)
    pose[JAW] = _bump(phase, 4 / 12, 0.27)
    pose[BROW] = _bump(phase, 4 / 12, 0.30)
    pose[SMILE] = 0.2 + 0.8 * _bump(phase, 10 / 12, 0.30)
    pose[GAZE_X] = 0.14 * math.sin(2 * math.pi * phase)
    pose[GAZE_Y] = 0.06 * math.sin(4 * math.pi * phase)
    return pose


def head_pose(time: float, amplitude: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Head -> world: R (3, 3) and t (3,) in mm, X_w = R X + t, as in Multiface's `_transform.txt`.

    Args:
        time: seconds.
        amplitude: of a nod and a turn, radians; 0 keeps the head still.
    """
    phase = 2 * math.pi * ((time / PERIOD) % 1.0)
    turn, nod = amplitude * math.sin(phase), 0.5 * amplitude * math.sin(2 * phase)
    about_y = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
    about_x = np.array([[1, 0, 0], [0, math.cos(nod), -math.sin(nod)], [0, math.sin(nod), math.cos(nod)]])
    return np.diag([1.0, -1.0, -1.0]) @ about_y @ about_x, np.array([0.0, 0.0, 1000.0])
