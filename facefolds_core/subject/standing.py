"""What stands still in the room while the head turns: shoulders, and the room. In the head's own frame it moves.

Two hypotheses for each Gaussian, told by the pictures of frames in which the head is turned farthest: it moves with the
head, or it stays where it was. A body moves or stays in large parts, so Gaussians decide together with their neighbours
(docs/research/moving-heads.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facefolds_core.geometry.track import Track
from facefolds_core.subject.fit import Target
from facefolds_core.subject.foreign import moved
from facefolds_core.subject.frames import shown_errors
from facefolds_core.subject.splats import Splats

Array = NDArray[np.float32]
Bool = NDArray[np.bool_]

NEIGHBOURS = 64
"""Gaussians decide together with so many others."""
LESS = 0.02
"""By so much less must they err if they stand still, mean of colours in [0, 1]. On `glasses` shoulders have 0.1, a face
-0.25."""
FRAMES = 2
"""In which it is looked."""


def farthest_turned(poses: Track, first: int) -> list[int]:
    """Up to `FRAMES` frames that differ in the head's turn most from the first and from one another."""
    chosen = [first]
    for _ in range(FRAMES):
        cosines = np.abs(poses.quaternions @ poses.quaternions[chosen].T).max(1)
        farthest = int(cosines.argmin())
        if farthest in chosen:
            break
        chosen.append(farthest)
    return chosen[1:]


def if_still(splats: Splats, poses: Track, first: int, frame: int) -> Splats:
    """Where Gaussians of the frame `first` are in the head's own frame in another, if they all stay in the room."""
    return moved(splats, poses.at(frame).inverse().after(poses.at(first)))


def in_frame(splats: Splats, stands: Bool, poses: Track, first: int, frame: int) -> Splats:
    """Gaussians of the frame `first` in another, in the head's own frame: those that stand (N,) stay in the room."""
    if frame == first or not stands.any():
        return splats
    still = if_still(splats, poses, first, frame)
    return replace(splats, values=np.where(stands[:, None], still.values, splats.values))


def standing(
    pairs: Sequence[tuple[Splats, Splats]], targets: Sequence[Sequence[Target]], means: Array, asked: Bool | None = None
) -> Bool:
    """(N,) Gaussians that err less if they stand still, mean over the frames and over their neighbours.

    Args:
        pairs: of each frame the Gaussians as they move with the head, and as they stand still.
        targets: of each frame.
        means: (N, 3) by which they are neighbours, units.
        asked: (N,) which may stand; others do not count, but are drawn. None: all.
    """
    asked = np.ones(len(means), bool) if asked is None else asked
    total, known = np.zeros(len(means)), np.zeros(len(means))
    for (turning, still), pictures in zip(pairs, targets, strict=True):
        (a, shown_a), (b, shown_b) = (shown_errors(one, pictures) for one in (turning, still))
        both = asked & (shown_a > 0) & (shown_b > 0)  # what no picture shows errs nowhere
        less = a[both] / shown_a[both] - b[both] / shown_b[both]
        total[both], known[both] = total[both] + less, known[both] + 1
    if not known.any():
        return np.zeros(len(means), bool)
    there = np.flatnonzero(known)
    _, near = cKDTree(means[there]).query(means, min(NEIGHBOURS, len(there)))
    mean = (total[there] / known[there])[near].reshape(len(means), -1).mean(1)
    return np.asarray(asked & (mean > LESS))
