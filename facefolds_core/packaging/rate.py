"""The coarsest video that reaches a quality: a search over the encoder's constant rate factor, with few encodings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

MAX_ENCODES = 6
CLOSE_ENOUGH = 0.15
"""dB above the target at which the search ends early."""
DB_A_STEP = 0.4
"""What one step of the factor costs, roughly, of any encoder: for the second guess."""


@dataclass(frozen=True)
class Found:
    """A factor and what it gave.

    Attributes:
        crf: the factor.
        psnr: dB; below the target if no factor reaches it.
        encodes: how many were made to find it.
    """

    crf: int
    psnr: float
    encodes: int


def search_crf(quality: Callable[[int], float], target: float, start: int, worst: int) -> Found:
    """The largest factor in [1, worst] whose quality is at least `target`, as far as MAX_ENCODES trials can tell.

    Args:
        quality: factor -> dB; falls as the factor grows. Each call is one encoding.
        start: the first factor that is tried.
    """
    tried: dict[int, float] = {}
    good, bad = 0, worst + 1  # `good` reaches the target, `bad` does not
    guess = min(max(start, 1), worst)
    while bad - good > 1 and len(tried) < MAX_ENCODES:
        tried[guess] = quality(guess)
        good, bad = (guess, bad) if tried[guess] >= target else (good, guess)
        if good and tried[good] - target < CLOSE_ENOUGH:
            break
        guess = _next(tried, good, bad, target)
    if good:
        return Found(good, tried[good], len(tried))
    best = min(tried)
    return Found(best, tried[best], len(tried))


def _next(tried: dict[int, float], good: int, bad: int, target: float) -> int:
    """Where a straight line through the trials nearest to the target meets it, strictly between `good` and `bad`."""
    if good in tried and bad in tried:
        slope = (tried[bad] - tried[good]) / (bad - good)
        guess = good + (target - tried[good]) / slope if slope else (good + bad) / 2
    else:
        near = min(tried, key=lambda crf: abs(tried[crf] - target))
        guess = near - (target - tried[near]) / DB_A_STEP
    return min(max(int(guess), good + 1), bad - 1)
