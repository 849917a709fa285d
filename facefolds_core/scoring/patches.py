"""Where an asset is worst: one window of all held-out pictures, truth beside asset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facefolds_core.scoring.backgrounds import Cutout, Patch, squared_error, worst_patch
from facefolds_core.scoring.images import Rendering
from facefolds_core.scoring.metrics import Array, shown

AROUND = 1.0
"""What the crops show around the window, in its sides."""
GREY = 0.5
"""Behind both crops: the same for truth and asset, so that opacity shows."""


@dataclass(frozen=True)
class WorstPatch:
    """Attributes:
    camera, frame: their names.
    place: where in the picture, and how bad.
    truth, asset: (h, w, 3) crops of it with its surroundings, over grey.
    corner: (row, column) of the crops' first pixel in the picture.
    """

    camera: str
    frame: str
    place: Patch
    truth: Array
    asset: Array
    corner: tuple[int, int]


def find_patch(camera: str, frame: str, asset: Rendering, truth: Cutout | None) -> WorstPatch | None:
    """The worst window of one picture; None where the subject's opacity is not known, or it is not there."""
    if truth is None:
        return None
    alpha = np.clip(asset.alpha.astype(np.float64), 0, 1)
    place = worst_patch(squared_error(asset.rgb, alpha, truth), truth.opacity)
    if place is None:
        return None
    more = round(AROUND * place.side)
    top, left = max(0, place.row - more), max(0, place.column - more)
    crop = (slice(top, place.row + place.side + more), slice(left, place.column + place.side + more))
    pictures = shown(truth.over(GREY)), shown(asset.over(GREY))
    return WorstPatch(camera, frame, place, pictures[0][crop], pictures[1][crop], (top, left))
