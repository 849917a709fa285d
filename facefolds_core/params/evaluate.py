"""`evaluate`: scores on the cameras that did not train."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Natural, Pixels, Section, Share


class ScoreWarningParams(Section):
    """When scores are said not to be well: a line in the terminal, in metrics.json and in the report."""

    min_temporal: Share = 0.2
    """Share of the variance over time that the asset should explain: below, its film stands still where the subject
    moves."""

    min_frames: Count = 8
    """With fewer, nothing is said of the change over time."""

    min_change: Share = 0.004
    """RMS of the photos' change over time, colours in [0, 1], from which on it is more than noise: a step of 8 bits."""


class EvaluateParams(Section):
    """Scores of the shipped files and the model (on the device of `train`)."""

    background: Annotated[tuple[Share, Share, Share], Field(strict=False)] = (0.0, 0.0, 0.0)
    """RGB in [0, 1] shown where the model or the asset is transparent."""

    sheet_frames: Count = 3
    """Frames shown for each held-out camera in the contact sheet, evenly spaced."""

    band: Pixels = 4.0
    """To both sides of the outline, pixels: how far the subject's mask is eroded and dilated for the scores inside and
    along it."""

    films: bool = True
    """Film the held-out cameras, truth and asset side by side: the report plays them."""

    film_crf: Annotated[int, Field(ge=0, le=51)] = 18
    """Constant rate factor of these films, of libx264: smaller is finer."""

    cvvdp_frames: Count = 60
    """Of each camera that CVVDP judges, where it is installed: they are held in memory together."""

    fresh_views: Natural = 0
    """For the embedded actor: so many new views, filmed for the purpose and scored by their angle; 0 films none."""

    warnings: ScoreWarningParams = ScoreWarningParams()
    """When scores are said not to be well."""
