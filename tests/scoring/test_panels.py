"""Which picture is the worst."""

from __future__ import annotations

import numpy as np

from facefolds_core.scoring.panels import ALL_METRICS, ImageScore, Panel


def panel(frame: str, **values: float) -> Panel:
    score = ImageScore("a", frame, "asset", dict.fromkeys(ALL_METRICS) | {"psnr": 5.0, **values})
    picture = np.zeros((2, 2, 3))
    return Panel("a", frame, picture, picture, picture, score, score)


def test_the_worst_is_the_one_that_the_headline_calls_so() -> None:
    """Pictures that lack the headline come last."""
    spikes = panel("spikes", psnr_subject=30.0, psnr_over_plate=17.0)
    blurred = panel("blurred", psnr_subject=22.0, psnr_over_plate=24.0)
    assert min([blurred, spikes], key=lambda one: one.rank) is spikes
    whole, subject = panel("whole"), panel("subject", psnr_subject=30.0)
    assert min([whole, subject], key=lambda one: one.rank) is subject
