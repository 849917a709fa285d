"""Scores of what the training cameras see of an asset, and which of them are bad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from facefolds_core.facts import Fact, fact
from facefolds_core.scoring.metrics import Array

BEHIND = 5.0
"""dB under the median of the training views from which on one is said to be bad."""

METRICS = ("psnr_any", "psnr_over_plate", "psnr_found")
"""By which they are compared: the first that all of them have, else the last."""


@dataclass(frozen=True)
class TrainingView:
    """One training camera's picture of the asset, of one frame.

    Attributes:
        camera, frame: their names.
        values: METRICS and the errors of opacity; None where one cannot be had.
        truth, asset: (H, W, 3) the photo, and the asset over the plate or over the background of `evaluate`.
    """

    camera: str
    frame: str
    values: dict[str, float | None]
    truth: Array
    asset: Array


def compared_by(views: Sequence[TrainingView]) -> str | None:
    """The metric by which they are compared; None if no camera sees the asset. One that does not has no
    `psnr_found`, and is worse than all others."""
    name = next((name for name in METRICS if all(view.values[name] is not None for view in views)), METRICS[-1])
    return name if not views or any(view.values[name] is not None for view in views) else None


def bad_views(views: Sequence[TrainingView]) -> list[TrainingView]:
    """Those that are `BEHIND` the median, worst first."""
    name = compared_by(views)
    if not views or name is None:
        return []
    least = _median(views, name) - BEHIND
    bad = [view for view in views if (view.values[name] or 0.0) < least]
    return sorted(bad, key=lambda view: view.values[name] or 0.0)


def warnings_of(views: Sequence[TrainingView]) -> list[Fact]:
    """A fact for each bad view."""
    name, bad = compared_by(views), bad_views(views)
    if name is None or not bad:
        return []
    median = _median(views, name)
    return [
        fact("training_view_bad", camera=view.camera, frame=view.frame, psnr=view.values[name] or 0.0, median=median)
        for view in bad
    ]


def _median(views: Sequence[TrainingView], name: str) -> float:
    return float(np.median([value for view in views if (value := view.values[name]) is not None]))
