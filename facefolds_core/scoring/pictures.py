"""Pictures that `evaluate` writes: the contact sheet (truth | model | asset | error for every held-out camera and a few
frames, in one PNG), where the asset is worst, and bad training views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from PIL import Image

from facefolds_core.files.writing import atomic_file
from facefolds_core.scoring.backgrounds import WorstPatch
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.panels import ImageScore, Panel
from facefolds_core.scoring.report import headline
from facefolds_core.scoring.terminal import HEADLINE_WORDS
from facefolds_core.scoring.training_scores import TrainingView

WORST = "worst.png"

MAX_ERROR = 0.25
"""The same end of the error scale on every sheet, so that sheets can be compared."""

COLUMNS = ("truth", "model", "asset", "error")
ERROR_COLOURS = "magma"
CELL, CAPTION, HEAD = 3.0, 0.3, 1.2
"""Inches: longer side of a picture, below each for its scores, above all for the heading."""


def error_image(image: Array, truth: Array, mask: Array | None = None) -> tuple[Array, float]:
    """Mean absolute error of R, G and B in colours (H, W, 3), and its mean over the image.

    Args:
        image, truth: (H, W, 3).
        mask: (H, W) opacity of the subject: the error is weighted with it, and the mean taken over the subject.
    """
    weight = np.ones(image.shape[:2]) if mask is None else mask
    error = np.abs(image - truth).mean(-1) * weight
    colours = np.asarray(colormaps[ERROR_COLOURS](np.clip(error / MAX_ERROR, 0, 1))[..., :3])
    return colours, float(error.sum() / max(float(weight.sum()), 1.0))


def write_contact_sheet(path: Path, subject: str, panels: Sequence[Panel], metrics: dict[str, Any]) -> None:
    """Draw the sheet.

    Args:
        panels: of all held-out cameras, frames in order.
        metrics: content of metrics.json, for the heading.
    """
    blocks = [[p for p in panels if p.camera == camera] for camera in dict.fromkeys(p.camera for p in panels)]
    rows, across = max(map(len, blocks)), math.ceil(math.sqrt(len(blocks)))
    down = math.ceil(len(blocks) / across)
    height, width = (CELL * side / max(panels[0].truth.shape[:2]) for side in panels[0].truth.shape[:2])
    block_width, block_height = len(COLUMNS) * width + 0.6, rows * (height + CAPTION) + 0.7
    figure = Figure((max(across * block_width, 8.0), down * block_height + HEAD), dpi=100)
    head, body = figure.subfigures(2, 1, squeeze=False, height_ratios=(HEAD, down * block_height)).flat
    head.text(0.02, 0.8, subject, fontsize=19, fontweight="bold", va="center")
    head.text(0.02, 0.45, _summary(metrics), fontsize=10, va="center")
    scale = ScalarMappable(Normalize(0, MAX_ERROR), ERROR_COLOURS)
    head.colorbar(scale, cax=head.add_axes((0.02, 0.15, 0.3, 0.1)), orientation="horizontal").ax.tick_params(
        labelsize=8
    )
    head.text(0.35, 0.2, "error: |asset - truth|, mean of R, G, B; of the subject alone where it is known", fontsize=9)
    for part, block in zip(body.subfigures(down, across, squeeze=False).flat, blocks, strict=False):
        part.suptitle(f"camera {block[0].camera}", fontsize=12, fontweight="bold", y=1 - 0.15 / block_height)
        grid = part.subplots(rows, len(COLUMNS), squeeze=False)
        left, bottom, top = 0.5 / block_width, 0.3 / block_height, 1 - 0.5 / block_height
        part.subplots_adjust(left, bottom, 0.99, top, 0.02, CAPTION / height)
        for axes in grid.flat:
            axes.set_axis_off()
        for name, axes in zip(COLUMNS, grid[0], strict=True):
            axes.set_title(name, fontsize=10)
        for panel, line in zip(block, grid, strict=False):
            _draw(line, panel)
    with atomic_file(path) as temporary:
        figure.savefig(temporary)


def _draw(line: Sequence[Any], panel: Panel) -> None:
    """One row: the pictures of a camera in a frame, and what is said of them."""
    error, mean_error = error_image(panel.asset, panel.truth, panel.mask)
    of = "" if panel.mask is None else "subject: "
    captions = ("", _caption(panel.model_score), _caption(panel.asset_score), f"{of}mean {mean_error:.4f}")
    for axes, image, caption in zip(line, (panel.truth, panel.model, panel.asset, error), captions, strict=True):
        axes.imshow(np.clip(image, 0, 1))
        axes.text(0.5, -0.03, caption, transform=axes.transAxes, ha="center", va="top", fontsize=8)
    turned = {"transform": line[0].transAxes, "rotation": 90, "ha": "right", "va": "center"}
    line[0].text(-0.03, 0.5, f"frame {panel.frame}", fontsize=8, **turned)


def _summary(metrics: dict[str, Any]) -> str:
    key, names = headline(metrics), {"model": "model", "diffuse": "model without view branch", "asset": "asset"}
    parts = [f"{name} {metrics[variant][key]:.2f} dB" for variant, name in names.items()]
    return f"Held-out cameras, mean PSNR {HEADLINE_WORDS[key]}:   " + "   ·   ".join(parts)


def _caption(score: ImageScore) -> str:
    """What says most of a picture, and within the subject beside it; no wider than a narrow picture: what the first
    figure is of stands in the heading."""
    key, within = score.headline, score.values.get("psnr_subject")
    if within is None or key == "psnr_subject":
        return f"{score.values[key]:.2f} dB {HEADLINE_WORDS[key]}"
    return f"{score.values[key]:.2f} dB, subject {within:.2f}"


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
