"""What is to be fitted in a long take: its key frames, and segments, each with all that its fitting takes."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.training.likeness import comparable, farthest_first, likenesses
from facefolds_core.training.segments.base import (
    digest_of_fitting,
    digest_of_training,
    digests_of_frames,
    fingerprint_of_base,
)
from facefolds_core.training.segments.keys import mixture


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
