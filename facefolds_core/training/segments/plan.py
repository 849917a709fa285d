"""What is to be fitted in a long take: its key frames, and segments, each with all that its fitting takes."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from facefolds_core.captures.part import part_of
from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.training.segments.base import (
    digest_of_fitting,
    digest_of_training,
    digests_of_frames,
    fingerprint_of_base,
)
from facefolds_core.training.segments.forecast import forecast
from facefolds_core.training.segments.keys import (
    Float,
    comparable,
    farthest_first,
    likenesses,
    mixture,
    named_frames,
)


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

    Raises:
        UserError: if a key frame is named that is not there.
    """
    digests = digests_of_frames(scene, progress(range(scene.num_frames), desc="fingerprints", unit="frame"))
    parts, segments = likenesses(scene, params.segments), params.segments
    keys = _key_frames(scene, parts, params, key_frames)
    base = fingerprint_of_base(scene, digest_of_training(params), keys, digests)
    common = base.encode() + digest_of_fitting(params)
    names = [hashlib.sha256(common + digest).hexdigest()[:16] for digest in digests]
    rows = comparable(parts, keys)
    shares = [tuple(mixture(row, rows[keys], segments).tolist()) for row in rows]
    found = []
    for number, first in enumerate(range(0, len(names), segments.frames)):
        part = slice(first, first + segments.frames)
        found.append(Segment(number, tuple(range(scene.num_frames)[part]), tuple(names[part]), tuple(shares[part])))
    return TakePlan(tuple(keys), base, tuple(found))


def trained_at_once(scene: Scene, params: ExplicitParams) -> tuple[Scene, list[int]]:
    """What the starting volume and the layers are fitted to, and the numbers of its frames in the scene: all of it, or
    the key frames of a take that is trained in segments.

    Raises:
        UserError: as `plan_take`.
    """
    count = forecast(scene, params).key_frames
    if count is None:
        return scene, list(range(scene.num_frames))
    keys = _key_frames(scene, likenesses(scene, params.segments), params, count)
    return part_of(scene, keys), keys


def _key_frames(scene: Scene, parts: Sequence[Float], params: ExplicitParams, count: int) -> list[int]:
    """Those that are named, else at most so many; `parts`: of `likenesses`."""
    named = params.segments.named
    return named_frames(scene, named) if named else farthest_first(comparable(parts), count)
