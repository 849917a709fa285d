"""The actor's take: a periodic function of time that says how eyes, jaw, lips and brows stand, and the head.

Everything but the mouth (speech.py) moves from pose to pose: it keeps still, then eases into the next one. The first
`EXCERPT` seconds, "Hello there" with a blink and a smile, loop by themselves.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.speech import mouth_at

PERIOD = 4.0
"""Seconds after which the take repeats."""
EXCERPT = 1.5
"""Seconds after which the face, and the head, stand as at the beginning for the first time."""

BLINK, JAW, PUCKER, BROW, SMILE, GAZE_X, GAZE_Y, NOSE, BALL = range(9)
"""Places in a pose; the last two are the subject's shape, still in time (`render.ActorOptions`)."""

Moves = tuple[tuple[float, float, float], ...]
"""(begin, seconds, value that is reached), in order of time; a move ends before the next one begins."""

# Lids fall in 70 ms, stay for 50 and rise in 160 to 180: about what people's do (VanderWerf et al., 2003).
_BLINK: Moves = ((0.91, 0.07, 1.0), (1.03, 0.16, 0.0), (3.62, 0.07, 1.0), (3.74, 0.18, 0.0))
_BROW: Moves = ((0.14, 0.20, 0.85), (0.62, 0.35, 0.0), (2.35, 0.22, 0.9), (2.75, 0.35, 0.1), (3.55, 0.25, 0.0))
_SMILE: Moves = (
    (0.0, 0.18, 0.1),
    (0.80, 0.28, 1.0),
    (1.20, 0.28, 0.3),
    (1.55, 0.15, 0.1),
    (3.42, 0.25, 0.8),
    (3.76, 0.23, 0.3),
)
# Saccades of 40 ms; the eyes come back during a blink.
_GAZE_X: Moves = (
    (0.40, 0.04, 0.14),
    (0.96, 0.04, 0.0),
    (1.62, 0.04, -0.13),
    (2.30, 0.04, 0.0),
    (2.88, 0.04, 0.07),
    (3.68, 0.04, 0.0),
)
_GAZE_Y: Moves = ((0.40, 0.04, 0.04), (0.96, 0.04, 0.0), (1.62, 0.04, -0.05), (2.30, 0.04, 0.02), (3.68, 0.04, 0.0))
# In shares of the amplitude: a turn to the head's left, a nod forwards, a lean to its left.
_TURN: Moves = ((0.05, 0.55, 1.0), (0.70, 0.75, 0.0), (1.55, 0.60, -1.0), (2.25, 0.60, 0.5), (3.10, 0.80, 0.0))
_NOD: Moves = (
    (0.05, 0.28, -0.25),
    (0.36, 0.30, 0.5),
    (0.75, 0.60, 0.0),
    (1.75, 0.35, 0.35),
    (2.40, 0.40, -0.3),
    (3.0, 0.40, 0.5),
    (3.5, 0.40, 0.0),
)
_LEAN: Moves = ((1.80, 0.60, 0.4), (2.95, 0.80, 0.0))

_NECK = np.array([0.0, -150.0, -40.0])
"""What the head turns about, head frame, mm: the base of the neck, so that it leans as people do."""


def _eased(moves: Moves, time: float) -> float:
    """Where something stands that keeps still but for its moves; each begins and ends at rest (a raised cosine)."""
    value = moves[-1][2]
    for begin, seconds, target in moves:
        if time < begin:
            break
        share = min((time - begin) / seconds, 1.0)
        value += (target - value) * (0.5 - 0.5 * math.cos(math.pi * share))
    return value


def pose_at(time: float) -> NDArray[np.float64]:
    """The pose at a time in seconds: (9,) blink, jaw, pucker, brow and smile in [0, 1], gaze right and up in radians,
    0, 0.
    """
    time %= PERIOD
    pose = np.zeros(9)
    opened, rounded, stretched = mouth_at(time, PERIOD)
    pose[BLINK] = _eased(_BLINK, time)
    pose[JAW], pose[PUCKER] = opened, rounded
    pose[BROW] = _eased(_BROW, time)
    pose[SMILE] = min(_eased(_SMILE, time) + 0.5 * stretched, 1.0)
    pose[GAZE_X], pose[GAZE_Y] = _eased(_GAZE_X, time), _eased(_GAZE_Y, time)
    return pose


def head_pose(time: float, amplitude: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Head -> world: R (3, 3) and t (3,) in mm, X_w = R X + t, as in Multiface's `_transform.txt`.

    Args:
        time: seconds.
        amplitude: of the turn, radians, with a nod and a lean of half as much; 0 keeps the head still.
    """
    time %= PERIOD
    turn, nod, lean = (amplitude * _eased(moves, time) for moves in (_TURN, _NOD, _LEAN))
    about_y = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
    about_x = np.array([[1, 0, 0], [0, math.cos(nod), -math.sin(nod)], [0, math.sin(nod), math.cos(nod)]])
    about_z = np.array([[math.cos(lean), math.sin(lean), 0], [-math.sin(lean), math.cos(lean), 0], [0, 0, 1]])
    rotation = about_y @ about_x @ about_z
    to_world = np.diag([1.0, -1.0, -1.0])
    return to_world @ rotation, to_world @ (_NECK - rotation @ _NECK) + np.array([0.0, 0.0, 1000.0])
