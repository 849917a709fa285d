"""The coarsest video that reaches a quality: a search over the encoder's constant rate factor, with few encodings."""

from __future__ import annotations

from collections.abc import Callable

FRAMES = 30
"""Frames that an attempt encodes, at most, from the first on."""

MAX_ENCODES = 6
"""Attempts; as many again where the target is out of reach."""

TOLERANCE = 0.15
"""The search ends early within this of the target, dB above it."""

SPARED = 0.2
"""Where the target is out of reach, so many dB are given up for fewer bits."""

SLOPE = 0.4
"""Rough cost of one step of the factor, dB: for the second attempt."""


def search_crf(quality: Callable[[int], float], target: float, start: int, worst: int) -> int:
    """The largest factor in [1, worst] whose quality is at least `target`, as far as `MAX_ENCODES` trials can tell.

    Where no factor reaches it (coarse textures lose more by 4:2:0 than the encoder does), bits without end would buy
    nothing: then the largest factor that is at most `SPARED` worse than the best one, in as many trials again.

    Args:
        quality: factor -> dB; falls as the factor grows. Each call is one encoding.
        start: the first factor that is tried.
    """
    tried: dict[int, float] = {}
    good = _search(quality, target, start, worst, tried)
    if not good:
        good = _search(quality, max(tried.values()) - SPARED, start, worst, tried)
    return good


def _search(
    quality: Callable[[int], float],
    target: float,
    start: int,
    worst: int,
    tried: dict[int, float],
) -> int:
    """The factor, 0 if none that was tried reaches the target. Trials are added to `tried`."""
    limit = len(tried) + MAX_ENCODES
    good = max((crf for crf in tried if tried[crf] >= target), default=0)  # reaches the target
    bad = min((crf for crf in tried if tried[crf] < target), default=worst + 1)  # does not
    guess = _next(tried, good, bad, target) if tried else min(max(start, 1), worst)
    while bad - good > 1 and len(tried) < limit:
        tried[guess] = quality(guess)
        good, bad = (guess, bad) if tried[guess] >= target else (good, guess)
        if good and tried[good] - target < TOLERANCE:
            break
        guess = _next(tried, good, bad, target)
    return good


def _next(tried: dict[int, float], good: int, bad: int, target: float) -> int:
    """Where a straight line through the trials nearest to the target meets it, strictly between `good` and `bad`."""
    if good in tried and bad in tried:
        slope = (tried[bad] - tried[good]) / (bad - good)
        guess = good + (target - tried[good]) / slope if slope else (good + bad) / 2
    else:
        near = min(tried, key=lambda crf: abs(tried[crf] - target))
        guess = near - (target - tried[near]) / SLOPE
    return min(max(int(guess), good + 1), bad - 1)
