"""The search for a quality finds the coarsest factor that has it, with few encodings."""

from __future__ import annotations

import math
from unittest.mock import Mock, call

import pytest

from facefolds_core.packaging.rate import MAX_ENCODES, SPARED, TOLERANCE, search_crf

CURVES = {
    "line": lambda crf: 52 - 0.5 * crf,
    "bent": lambda crf: 60 - 4 * math.sqrt(crf),
    "steps": lambda crf: 50 - 3.0 * (crf // 6),
    "steep": lambda crf: 80 - 1.6 * crf,
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
@pytest.mark.parametrize("target", [31.0, 38.0, 44.0])
@pytest.mark.parametrize("start", [1, 18, 51])
def test_target_is_reached_and_no_factor_far_better_is_missed(curve: object, target: float, start: int) -> None:
    assert callable(curve)
    quality = Mock(side_effect=curve)
    found = search_crf(quality, target, start, 51)
    assert quality.call_count <= MAX_ENCODES
    assert call(found) in quality.mock_calls and curve(found) >= target
    best = max(crf for crf in range(1, 52) if curve(crf) >= target)
    assert curve(found) - target < TOLERANCE or best - found <= 6


def test_a_target_out_of_reach_gives_the_best_that_was_tried() -> None:
    assert search_crf(lambda crf: 40 - crf, 60, 18, 51) == 1


@pytest.mark.parametrize("start", [1, 18, 51])
def test_a_target_out_of_reach_does_not_buy_what_changes_nothing(start: int) -> None:
    def curve(crf: int) -> float:
        """4:2:0 alone leaves 39.2 dB."""
        return -10 * math.log10(10**-3.92 + 10 ** (-(60 - 0.6 * crf) / 10))

    quality = Mock(side_effect=curve)
    found = search_crf(quality, 41, start, 51)
    assert found >= 6 and call(found) in quality.mock_calls
    assert curve(1) - SPARED <= curve(found)
    assert quality.call_count <= 2 * MAX_ENCODES


def test_a_target_that_everything_reaches_gives_the_coarsest() -> None:
    assert search_crf(lambda crf: 90 - crf, 20, 18, 51) == 51
