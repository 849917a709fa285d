"""The contact sheet: truth | model | asset | error for every held-out camera and a few frames, in one PNG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from facefolds_core.files.writing import atomic_file
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.panels import ImageScore, Panel
from facefolds_core.scoring.report import headline
from facefolds_core.scoring.terminal import HEADLINE_WORDS

MAX_ERROR = 0.25
"""The same end of the error scale on every sheet, so that sheets can be compared."""

COLUMNS = ("truth", "model", "asset", "error")
CELL_HEIGHT, CELL_WIDTH = 300, 380
"""Box that a panel's image is scaled to fit into, pixels."""
GAP, CAPTION, FRAME_LABEL, BLOCK_HEAD = 6, 24, 26, 52
"""Pixels: between panels, below each for its scores, left of each row for the frame, above each camera's block."""
MARGIN, TITLE, FOOTER = 28, 74, 66
ASPECT = 1.5
"""Width to height that the arrangement of the cameras' blocks comes nearest to."""

DPI = 100
INK, FAINT, PAPER = "#1c2126", "#68717a", "#ffffff"
ERROR_COLOURS = "magma"


@dataclass(frozen=True)
class SheetLayout:
    """Places on the sheet, pixels from the top left corner.

    Attributes:
        cell: (width, height) of a panel's image.
        cameras, rows: number of blocks, and of rows (frames) in each.
        across: blocks side by side.
    """

    cell: tuple[int, int]
    cameras: int
    rows: int
    across: int

    @property
    def block(self) -> tuple[int, int]:
        """(width, height) of one camera's block."""
        width = FRAME_LABEL + len(COLUMNS) * self.cell[0] + (len(COLUMNS) - 1) * GAP
        return width, BLOCK_HEAD + self.rows * (self.cell[1] + CAPTION)

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the sheet."""
        down = -(-self.cameras // self.across)
        width = 2 * MARGIN + self.across * self.block[0] + (self.across - 1) * MARGIN
        return width, TITLE + down * self.block[1] + FOOTER

    def corner(self, camera: int) -> tuple[int, int]:
        """Top left corner of a block."""
        row, column = divmod(camera, self.across)
        return MARGIN + column * (self.block[0] + MARGIN), TITLE + row * self.block[1]


def plan(width: int, height: int, cameras: int, rows: int) -> SheetLayout:
    """Arrange `cameras` blocks of `rows` rows of panels of images of `width` x `height`."""
    scale = min(CELL_WIDTH / width, CELL_HEIGHT / height)
    cell = (round(width * scale), round(height * scale))

    def distance(across: int) -> float:
        w, h = SheetLayout(cell, cameras, rows, across).size
        return abs(math.log(w / h / ASPECT))

    return SheetLayout(cell, cameras, rows, min(range(1, cameras + 1), key=distance))


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
    cameras = list(dict.fromkeys(p.camera for p in panels))
    blocks = [[p for p in panels if p.camera == camera] for camera in cameras]
    height, width = panels[0].truth.shape[:2]
    layout = plan(width, height, len(cameras), max(map(len, blocks)))
    sheet = _Sheet(layout)
    sheet.text(MARGIN, 26, subject, size=19, weight="bold")
    sheet.text(MARGIN, 54, _summary(metrics), size=10.5, colour=FAINT)
    for i, (camera, block) in enumerate(zip(cameras, blocks, strict=True)):
        _draw_block(sheet, layout.corner(i), camera, block)
    sheet.colour_bar()
    with atomic_file(path) as temporary:
        sheet.save(temporary)


def _summary(metrics: dict[str, Any]) -> str:
    names = {"model": "model", "diffuse": "model without view branch", "asset": "asset"}
    parts, key = [], headline(metrics)
    for variant, name in names.items():
        values = metrics[variant]
        parts.append(f"{name} {values[key]:.2f} dB")
    return f"Held-out cameras, mean PSNR {HEADLINE_WORDS[key]}:   " + "   ·   ".join(parts)


def _draw_block(sheet: _Sheet, corner: tuple[int, int], camera: str, block: Sequence[Panel]) -> None:
    left, top = corner
    width, height = sheet.layout.cell
    sheet.text(left + FRAME_LABEL, top + 12, f"camera {camera}", size=12, weight="bold")
    for column, name in enumerate(COLUMNS):
        sheet.text(left + FRAME_LABEL + column * (width + GAP) + width / 2, top + 38, name, size=10.5, centred=True)
    for row, panel in enumerate(block):
        y = top + BLOCK_HEAD + row * (height + CAPTION)
        error, mean_error = error_image(panel.asset, panel.truth, panel.mask)
        of = "" if panel.mask is None else "subject: "
        captions = ("", _caption(panel.model_score), _caption(panel.asset_score), f"{of}mean {mean_error:.4f}")
        sheet.text(left + 10, y + height / 2, f"frame {panel.frame}", size=8.5, colour=FAINT, centred=True, rotation=90)
        for column, image in enumerate((panel.truth, panel.model, panel.asset, error)):
            x = left + FRAME_LABEL + column * (width + GAP)
            sheet.image(x, y, image)
            sheet.text(x + width / 2, y + height + CAPTION / 2 - 1, captions[column], size=8.5, centred=True)


def _caption(score: ImageScore) -> str:
    """What says most of a picture, and within the subject beside it; no wider than a narrow picture: what the first
    figure is of stands in the heading."""
    key, within = score.headline, score.values.get("psnr_subject")
    if within is None or key == "psnr_subject":
        return f"{score.values[key]:.2f} dB {HEADLINE_WORDS[key]}"
    return f"{score.values[key]:.2f} dB, subject {within:.2f}"


class _Sheet:
    """A figure on which one unit is one pixel, y down."""

    def __init__(self, layout: SheetLayout) -> None:
        self.layout = layout
        self.width, self.height = layout.size
        self._figure = Figure((self.width / DPI, self.height / DPI), dpi=DPI, facecolor=PAPER)
        FigureCanvasAgg(self._figure)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        size: float,
        colour: str = INK,
        weight: str = "normal",
        centred: bool = False,
        rotation: float = 0,
    ) -> None:
        """Text at (x, y): its left end's (or its own) middle."""
        self._figure.text(
            x / self.width,
            1 - y / self.height,
            text,
            fontsize=size,
            color=colour,
            fontweight=weight,
            ha="center" if centred else "left",
            va="center",
            rotation=rotation,
        )

    def image(self, x: int, y: int, image: Array) -> None:
        """An image with its top left corner at (x, y), scaled to the layout's cell."""
        width, height = self.layout.cell
        method = cv2.INTER_AREA if width <= image.shape[1] else cv2.INTER_CUBIC
        scaled = np.clip(cv2.resize(np.asarray(image, np.float32), (width, height), interpolation=method), 0, 1)
        pixels: NDArray[np.uint8] = np.round(scaled * 255).astype(np.uint8)
        self._figure.figimage(pixels, x, self.height - y - height, origin="upper")

    def colour_bar(self) -> None:
        """The error's scale, at the foot of the sheet."""
        width = min(420, self.width - 2 * MARGIN)
        box = (MARGIN / self.width, 34 / self.height, width / self.width, 12 / self.height)
        axes = self._figure.add_axes(box)
        axes.imshow(np.linspace(0, 1, 256)[None], cmap=ERROR_COLOURS, aspect="auto", extent=(0, MAX_ERROR, 0, 1))
        axes.set_yticks([])
        axes.set_xticks(np.linspace(0, MAX_ERROR, 6))
        axes.tick_params(labelsize=8, colors=FAINT, length=3)
        for edge in axes.spines.values():
            edge.set_visible(False)
        label = "error: |asset − truth|, mean of R, G, B in [0, 1]; of the subject alone where its mask is known"
        if self.width > MARGIN + width + 640:
            self.text(MARGIN + width + 16, self.height - 40, label, size=9, colour=FAINT)
        else:
            self.text(MARGIN, self.height - 56, label, size=9, colour=FAINT)

    def save(self, path: Path) -> None:
        self._figure.savefig(path, dpi=DPI, facecolor=PAPER)
