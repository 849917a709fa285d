"""Pictures of what `evaluate` saw that are worth a look: where the asset is worst, and bad training views."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from facefolds_core.scoring.backgrounds import WorstPatch
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.panels import Panel
from facefolds_core.scoring.training_scores import TrainingView

WORST = "worst.png"


def write_worst(path: Path, worst: Panel, patch: WorstPatch | None) -> None:
    """Photo beside asset: the worst window of all held-out pictures, framed, with what lies around it; where that is
    not known, the worst picture."""
    if patch is None:
        return _write(path, worst.truth, worst.shown)
    x, y = patch.place.column - patch.corner[1], patch.place.row - patch.corner[0]
    end = patch.place.side - 1
    framed = [image.copy() for image in (patch.truth, patch.asset)]
    for image in framed:
        cv2.rectangle(image, (x, y), (x + end, y + end), (1.0, 1.0, 1.0))
    return _write(path, *framed)


def training_picture(folder: Path, camera: str) -> Path:
    """Where `write_training_views` puts the picture of a camera."""
    return folder / f"training_{camera}.png"


def write_training_views(folder: Path, views: Sequence[TrainingView]) -> None:
    """Photo beside asset of each, in a new folder."""
    folder.mkdir()
    for view in views:
        _write(training_picture(folder, view.camera), view.truth, view.asset)


def _write(path: Path, truth: Array, asset: Array) -> None:
    Image.fromarray(np.rint(255 * np.clip(np.concatenate([truth, asset], 1), 0, 1)).astype(np.uint8)).save(path)
