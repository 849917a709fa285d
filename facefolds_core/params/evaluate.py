"""`evaluate`: scores on the cameras that did not train."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Section, Share


class EvaluateParams(Section):
    """Scores of the shipped files and the model (on the device of `train`)."""

    background: Annotated[tuple[Share, Share, Share], Field(strict=False)] = (0.0, 0.0, 0.0)
    """RGB in [0, 1] shown where the model or the asset is transparent."""

    sheet_frames: Count = 3
    """Frames of each held-out camera in the contact sheet, evenly spaced."""

    films: bool = True
    """Film the held-out cameras, truth and asset side by side, for the report."""
