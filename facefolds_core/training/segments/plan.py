"""What is to be fitted in a long take: its key frames, and segments, each with all that its fitting takes."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.training.likeness import Float, comparable, farthest_first, likenesses, squares
from facefolds_core.training.segments.base import (
    digest_of_fitting,
    digest_of_training,
    digests_of_frames,
    fingerprint_of_base,
)

NEIGHBOURS = 3
"""A frame starts from the mean of so many key frames, weighted by likeness."""

BLEND = 0.5
"""How much key frames are made like the others, in mean distances between key frames. With 0 they start from themselves
alone."""


@dataclass(frozen=True)
class Segment:
    """Attributes:
    number: in the take.
    frames: of the scene.
    names: their fingerprints, 16 hex digits each.
    shares: of the key frames that each of them starts from.
    """

    number: int
    frames: tuple[int, ...]
    names: tuple[str, ...]
    shares: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class TakePlan:
    """Attributes:
    keys: key frames.
    base: fingerprint of the base.
    segments: of the whole take.
    """

    keys: tuple[int, ...]
    base: str
    segments: tuple[Segment, ...]


def plan_take(scene: Scene, params: ExplicitParams, key_frames: int) -> TakePlan:
    """Look at all pictures: which are the key frames, what each frame is fitted to, what it starts from.

    Args:
        key_frames: at most.
    """
    digests = digests_of_frames(scene, progress(range(scene.num_frames), desc="fingerprints", unit="frame"))
    parts, segments = likenesses(scene), params.segments
    keys = farthest_first(comparable(parts), key_frames)
    base = fingerprint_of_base(scene, digest_of_training(params), keys, digests)
    common = base.encode() + digest_of_fitting(params)
    names = [hashlib.sha256(common + digest).hexdigest()[:16] for digest in digests]
    rows = comparable(parts, keys)
    shares = [tuple(mixture(row, rows[keys]).tolist()) for row in rows]
    found = []
    for number, first in enumerate(range(0, len(names), segments.frames)):
        part = slice(first, first + segments.frames)
        found.append(Segment(number, tuple(range(scene.num_frames)[part]), tuple(names[part]), tuple(shares[part])))
    return TakePlan(tuple(keys), base, tuple(found))


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
