"""`evaluate`: scores on the cameras that did not train."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from facefolds_core.params.base import Count, Section, Share


class ScoreWarningParams(Section):
    """When scores are said not to be well: a line in the terminal, in metrics.json and in the report."""

    min_temporal: Share = 0.2
    """Least share of the variance over time that the asset should explain."""

    min_frames: Count = 8
    """With fewer frames nothing is said of the change over time."""

    min_change: Share = 0.004
    """RMS of the photos' change over time, colours in [0, 1], above which it is more than noise."""


class EvaluateParams(Section):
    """Scores of the shipped files and the model (on the device of `train`)."""

    background: Annotated[tuple[Share, Share, Share], Field(strict=False)] = (0.0, 0.0, 0.0)
    """RGB in [0, 1] shown where the model or the asset is transparent."""

    sheet_frames: Count = 3
    """Frames of each held-out camera in the contact sheet, evenly spaced."""

    band: ClassVar[float] = 4.0
    """Pixels to both sides of the outline that are scored apart."""

    films: bool = True
    """Film the held-out cameras, truth and asset side by side, for the report."""

    film_crf: ClassVar[int] = 18
    """Constant rate factor of the report's films, of libx264: smaller is finer."""

    warnings: ClassVar[ScoreWarningParams] = ScoreWarningParams()
    """When scores are said not to be well."""
