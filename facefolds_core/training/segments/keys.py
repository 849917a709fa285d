"""What each frame of a take is made of: shares of its key frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.training.likeness import Float, squares

NEIGHBOURS = 3
"""A frame starts from the mean of so many key frames, weighted by likeness."""

BLEND = 0.5
"""How much key frames are made like the others, in mean distances between key frames. With 0 they start from themselves
alone."""


def _apart(keys: Float) -> float:
    """Mean distance of a key frame from the one most like it; 0 of a single one."""
    if len(keys) < 2:
        return 0.0
    return float(np.mean([np.sqrt(np.partition(squares(keys, key), 1)[1]) for key in keys]))


def mixture(row: Float, keys: Float) -> NDArray[np.float64]:
    """(n,) shares of key frames (n, D) that make up a frame (D,), their sum 1; 0 but for the `NEIGHBOURS` nearest.

    ((d_far - d_i) / (d_far d_i))^2 with d_far the distance of the next one (modified Shepard weights; Franke and
    Nielson 1980): they change without a leap when another key frame becomes one of the nearest.
    Distances are those of places beside the key frames, so that these, too, are made of their neighbours.
    """
    distance = np.sqrt(squares(keys, row) + (BLEND * _apart(keys)) ** 2)
    if distance.min() == 0:
        shares = (distance == 0).astype(np.float64)
        return np.asarray(shares / shares.sum())
    beyond = np.sort(distance)[min(NEIGHBOURS, len(distance) - 1)] if len(distance) > 1 else 2 * distance[0]
    shares = np.square(np.maximum(beyond - distance, 0) / (beyond * distance))
    if shares.sum() == 0:  # all equally far
        shares = np.ones(len(distance))
    return np.asarray(shares / shares.sum())
