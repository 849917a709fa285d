"""The coarsest video that reaches a quality: a search over the encoder's constant rate factor, with few encodings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from facefolds_core.params import CrfSearchParams

_USUAL = CrfSearchParams()


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


def search_crf(
    quality: Callable[[int], float], target: float, start: int, worst: int, params: CrfSearchParams = _USUAL
) -> Found:
    """The largest factor in [1, worst] whose quality is at least `target`, as far as `max_encodes` trials can tell.

    Where no factor reaches it (coarse textures lose more by 4:2:0 than the encoder does), bits without end would buy
    nothing: then the largest factor that is at most `spared` worse than the best one, in as many trials again.

    Args:
        quality: factor -> dB; falls as the factor grows. Each call is one encoding.
        start: the first factor that is tried.
    """
    tried: dict[int, float] = {}
    good = _search(quality, target, start, worst, tried, params)
    if not good:
        good = _search(quality, max(tried.values()) - params.spared, start, worst, tried, params)
    return Found(good, tried[good], len(tried))


def _search(
    quality: Callable[[int], float],
    target: float,
    start: int,
    worst: int,
    tried: dict[int, float],
    params: CrfSearchParams,
) -> int:
    """The factor, 0 if none that was tried reaches the target. Trials are added to `tried`."""
    limit = len(tried) + params.max_encodes
    good = max((crf for crf in tried if tried[crf] >= target), default=0)  # reaches the target
    bad = min((crf for crf in tried if tried[crf] < target), default=worst + 1)  # does not
    guess = _next(tried, good, bad, target, params.slope) if tried else min(max(start, 1), worst)
    while bad - good > 1 and len(tried) < limit:
        tried[guess] = quality(guess)
        good, bad = (guess, bad) if tried[guess] >= target else (good, guess)
        if good and tried[good] - target < params.tolerance:
            break
        guess = _next(tried, good, bad, target, params.slope)
    return good


def _next(tried: dict[int, float], good: int, bad: int, target: float, usual_slope: float) -> int:
    """Where a straight line through the trials nearest to the target meets it, strictly between `good` and `bad`."""
    if good in tried and bad in tried:
        slope = (tried[bad] - tried[good]) / (bad - good)
        guess = good + (target - tried[good]) / slope if slope else (good + bad) / 2
    else:
        near = min(tried, key=lambda crf: abs(tried[crf] - target))
        guess = near - (target - tried[near]) / usual_slope
    return min(max(int(guess), good + 1), bad - 1)
