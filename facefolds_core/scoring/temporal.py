"""What changes from frame to frame: how much of it a rendering shows, and how much its error flickers.

Everything is summed pixel by pixel over the frames of a camera, so that one frame at a time is held in memory.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from facefolds_core.scoring.metrics import Array, decibels


@dataclass(frozen=True)
class Sums:
    """Over the subject's pixels, their three channels, and the frames of some cameras.

    Attributes:
        left: sum |(x_t - mean x) - (y_t - mean y)|^2, x the rendering and y the photos.
        truth: sum |y_t - mean y|^2.
        values: how many values these sums are over, weighted.
        moving: sum |y_t - mean y|^2 |x_t - y_t|^2 / 3: errors, weighted with how far the photo is from its mean.
        steps: sum |e_t - e_(t-1)|^2, e = x - y.
        pairs: how many values that sum is over, weighted.
    """

    left: float = 0.0
    truth: float = 0.0
    values: float = 0.0
    moving: float = 0.0
    steps: float = 0.0
    pairs: float = 0.0

    def __add__(self, other: Sums) -> Sums:
        own, others = vars(self), vars(other)
        return Sums(**{name: own[name] + others[name] for name in own})


@dataclass(frozen=True)
class Change:
    """Attributes:
    temporal: share of the photos' variance over time that the rendering explains, 1 - left / truth: 1 for the photos
        themselves, 0 for a film that stands still, below for one that moves otherwise; None where nothing changes.
    psnr_moving: dB of the error where and when the photos change, weighted with |y_t - mean y|^2; None where nothing
        changes.
    flicker: RMS of the error's change from frame to frame, colours in [0, 1]; None with less than two frames.
    truth_change: RMS of what the photos differ from their mean over time; None with less than two frames.
    """

    temporal: float | None
    psnr_moving: float | None
    flicker: float | None
    truth_change: float | None


def change_of(sums: Iterable[Sums]) -> Change:
    """Of all cameras together."""
    total = sum(sums, Sums())
    return Change(
        temporal=1 - total.left / total.truth if total.truth > 0 else None,
        psnr_moving=decibels(total.moving / total.truth) if total.truth > 0 else None,
        flicker=float(np.sqrt(total.steps / total.pairs)) if total.pairs > 0 else None,
        truth_change=float(np.sqrt(total.truth / total.values)) if total.pairs > 0 else None,
    )


class Film:
    """The frames of one camera, in order.

    The subject's pixels are weighted with the least opacity that they have in any frame: what it uncovers of the room
    is not its change.
    """

    def __init__(self) -> None:
        self._frames = 0
        self._pairs = 0
        self._last = -2
        self._weight: Array | None = None
        self._truth = _Moments()
        self._errors: dict[str, _Moments] = {}
        self._moving: dict[str, _Weighted] = {}

    def add(self, frame: int, pictures: Mapping[str, Array], truth: Array, weight: Array) -> None:
        """Args:
        frame: its index; the error's change is taken between neighbours only.
        pictures: name -> (H, W, 3).
        truth: (H, W, 3).
        weight: (H, W) opacity of the subject.
        """
        follows = frame == self._last + 1
        self._weight = weight if self._weight is None else np.minimum(self._weight, weight)
        self._truth.add(truth, follows)
        for name, picture in pictures.items():
            self._errors.setdefault(name, _Moments()).add(picture - truth, follows)
            self._moving.setdefault(name, _Weighted()).add(((picture - truth) ** 2).mean(-1), truth)
        self._frames, self._pairs, self._last = self._frames + 1, self._pairs + follows, frame

    def sums(self) -> dict[str, Sums]:
        """Of each name; empty without frames."""
        weight = self._weight
        if weight is None:
            return {}
        covered = 3 * float(weight.sum())
        truth = float((weight * self._truth.spread()).sum())
        return {
            name: Sums(
                left=float((weight * errors.spread()).sum()),
                truth=truth,
                values=self._frames * covered,
                moving=float((weight * self._moving[name].by_change()).sum()),
                steps=float((weight * errors.steps).sum()),
                pairs=self._pairs * covered,
            )
            for name, errors in self._errors.items()
        }


class _Moments:
    """Sums over frames of (H, W, 3) values at each pixel."""

    def __init__(self) -> None:
        self._count = 0
        self._first: Array | None = None
        self._last: Array | None = None
        self._sum: Array | float = 0.0
        self._squares: Array | float = 0.0
        self.steps: Array | float = 0.0
        """(H, W) sum of squared differences between neighbours, over the channels."""

    def add(self, value: Array, follows: bool) -> None:
        if self._first is None:  # sums of small numbers lose no digits
            self._first = value
        moved = value - self._first
        self._sum = self._sum + moved
        self._squares = self._squares + (moved**2).sum(-1)
        if follows and self._last is not None:
            self.steps = self.steps + ((value - self._last) ** 2).sum(-1)
        self._last = value
        self._count += 1

    def spread(self) -> Array:
        """(H, W) sum over frames and channels of |value - mean|^2."""
        mean = np.asarray(self._sum) / self._count
        return np.asarray(np.maximum(self._squares - self._count * (mean**2).sum(-1), 0.0))


class _Weighted:
    """Sums over frames of an error (H, W), weighted with powers of the photos (H, W, 3)."""

    def __init__(self) -> None:
        self._count = 0
        self._first: Array | None = None
        self._photos: Array | float = 0.0
        self._sums: tuple[Array | float, Array | float, Array | float] = (0.0, 0.0, 0.0)

    def add(self, error: Array, photo: Array) -> None:
        if self._first is None:  # sums of small numbers lose no digits
            self._first = photo
        moved = photo - self._first
        self._photos = self._photos + moved
        none, one, two = self._sums
        self._sums = (none + error, one + error[..., None] * moved, two + error * (moved**2).sum(-1))
        self._count += 1

    def by_change(self) -> Array:
        """(H, W) sum over frames of error |photo - mean|^2."""
        mean = np.asarray(self._photos) / self._count
        none, one, two = (np.asarray(part) for part in self._sums)
        return np.asarray(np.maximum(two - 2 * (mean * one).sum(-1) + (mean**2).sum(-1) * none, 0.0))
