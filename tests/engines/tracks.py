"""A head that turns and moves, for exporters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from facefolds_core.asset.reader import AssetLevel
from facefolds_core.geometry.torso import Torso
from facefolds_core.geometry.track import Track


def with_track(level: AssetLevel, degrees: float = 20.0) -> AssetLevel:
    """The level with a head that turns to its left by `degrees` in its last frame, and moves forward."""
    angles = np.radians(np.linspace(0, degrees, level.num_frames))
    turns = [[[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in angles]
    return replace(level, track=Track.of(turns, [[0.1 * a, 0.02, 0] for a in angles]))


def over_torso(level: AssetLevel) -> AssetLevel:
    """The head of a level moves over a torso that stays as it was in the first frame."""
    torso = Torso.at([0.0, 0.0, -1.0], -0.05, 0.1, level.track.at(0))
    return replace(level, track=replace(level.track, torso=torso))
