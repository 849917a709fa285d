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

from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.torso import Torso
from facefolds_core.geometry.track import Track
from facefolds_core.subject.fit import TargetPicture
from facefolds_core.subject.foreign import moved
from facefolds_core.subject.frames import shown_errors
from facefolds_core.subject.splats import Splats

Array = NDArray[np.float32]
Bool = NDArray[np.bool_]

NEIGHBOURS = 64
"""Gaussians decide together with so many others."""
NOTHING = 1e-3
"""Frames that differ by less, radians and units, tell nothing."""
LESS = 0.02
"""By so much less must they err if they stand still, mean of colours in [0, 1]. On `glasses` shoulders have 0.1, a face
-0.25."""
FRAMES = 2
"""In which it is looked; they must agree."""
SHARE = 0.02
"""Of the Gaussians that are asked: where fewer stand, none does."""


BAND = 0.08
"""Width of what follows both head and torso, units: a neck's height. Where the head goes less far there, none folds."""
RIDGE = 1e-3
"""Of the plane's slope, against one that ends nowhere where head and torso lie quite apart."""
ROUNDS = 25
"""Newton's, of the plane."""
APART = 0.9
"""Least share of the opacity that lies on its own side of the plane; else there is none. `glasses` has 0.98."""


def torso_of(splats: Splats, stands: Bool, pose: Similarity) -> Torso | None:
    """The plane between what stands still and what moves with the head: logistic regression of the one on the places of
    the Gaussians, each as much as it is opaque. None where nothing or all stands, or no plane parts them.

    Args:
        pose: of the head, whose own frame they are in, in the frame that they show; head -> world.
    """
    if stands.all() or not stands.any():
        return None
    weight = splats.opacities.astype(np.float64) / splats.opacities.sum()
    places = splats.means.astype(np.float64)
    middle = weight @ places
    scale = float(np.sqrt(weight @ np.square(places - middle).sum(1)))
    x = np.concatenate([(places - middle) / scale, np.ones((len(places), 1))], 1)
    price, slope = RIDGE * np.diag([1.0, 1, 1, 0]), np.zeros(4)
    for _ in range(ROUNDS):
        chance = 1 / (1 + np.exp(-(x @ slope).clip(-30, 30)))
        pull = x.T @ (weight * (chance - stands)) + price @ slope
        curvature = (x * (weight * np.maximum(chance * (1 - chance), 1e-6))[:, None]).T @ x + price
        slope = slope - np.linalg.solve(curvature, pull)
    steep = max(float(np.linalg.norm(slope[:3])), 1e-12)
    normal = slope[:3] / steep
    border = float(normal @ middle) - scale * float(slope[3]) / steep
    apart = float(weight[((places @ normal) > border) == stands].sum())
    return Torso.at(normal, border - BAND / 2, BAND, pose) if apart >= APART else None


def farthest_moved(poses: Track, first: int) -> list[int]:
    """Up to `FRAMES` frames that differ most from the first and from one another: by the head's turn, radians, and its
    shift, units."""
    chosen = [first]
    for _ in range(FRAMES):
        turns = 2 * np.arccos(np.abs(poses.quaternions @ poses.quaternions[chosen].T).clip(0, 1))
        shifts = np.linalg.norm(poses.translations[:, None] - poses.translations[chosen], axis=-1)
        away = (turns + shifts).min(1)
        farthest = int(away.argmax())
        if farthest in chosen or away[farthest] < NOTHING:
            break
        chosen.append(farthest)
    return chosen[1:]


def if_still(splats: Splats, poses: Track, first: int, frame: int) -> Splats:
    """Where Gaussians of the frame `first` are in the head's own frame in another, if they all stay in the room."""
    return moved(splats, poses.at(frame).inverse().after(poses.at(first)))


def in_frame(splats: Splats, stands: Bool, poses: Track, first: int, frame: int) -> Splats:
    """Gaussians of the frame `first` in another, in the head's own frame: those that stand (N,) stay in the room."""
    return splats if frame == first else in_part(splats, stands, poses.at(frame).inverse().after(poses.at(first)))


def in_part(splats: Splats, which: Bool, motion: Similarity) -> Splats:
    """Gaussians of which some (N,) are moved."""
    if not which.any():
        return splats
    return replace(splats, values=np.where(which[:, None], moved(splats, motion).values, splats.values))


def standing(
    pairs: Sequence[tuple[Splats, Splats]],
    targets: Sequence[Sequence[TargetPicture]],
    means: Array,
    asked: Bool | None = None,
) -> Bool:
    """(N,) Gaussians that err less if they stand still, mean over their neighbours, in each frame that shows them.

    Args:
        pairs: of each frame the Gaussians as they move with the head, and as they stand still.
        targets: of each frame.
        means: (N, 3) by which they are neighbours, units.
        asked: (N,) which may stand; others do not count, but are drawn. None: all.
    """
    asked = np.ones(len(means), bool) if asked is None else asked
    stands, told = asked.copy(), False
    for (turning, still), pictures in zip(pairs, targets, strict=True):
        (a, shown_a), (b, shown_b) = (shown_errors(one, pictures) for one in (turning, still))
        there = np.flatnonzero(asked & (shown_a > 0) & (shown_b > 0))  # what no picture shows errs nowhere
        if not len(there):
            continue
        less = a[there] / shown_a[there] - b[there] / shown_b[there]
        _, near = cKDTree(means[there]).query(means, min(NEIGHBOURS, len(there)))
        stands &= less[near].reshape(len(means), -1).mean(1) > LESS
        told = True
    return np.asarray(stands & (told and stands.sum() >= SHARE * asked.sum()))
