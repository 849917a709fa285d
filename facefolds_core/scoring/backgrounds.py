"""Error over any background: what a picture is worth wherever it is put (docs/reference/metrics.md, `psnr_any`).

A head over black says nothing of how dark its haze is, and one over its own room nothing of what is left of that room
in its hair. Over black, white and grey at once opacity counts everywhere, as colour does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import uniform_filter

from facefolds_core.captures.cutout import cut_from
from facefolds_core.scoring.metrics import Array, decibels, shown

BACKGROUNDS = (0.0, 1.0, 0.5)
"""Black, white, mid grey."""

PATCH_SHARE = 1 / 8
"""A patch's side, in those of a square that is as large as the subject."""
LEAST_PATCH = 8
"""Pixels: a smaller patch is a handful of pixels."""
COVERED = 0.5
"""Mean opacity of a patch from which on it is taken to show the subject."""

AROUND = 1.0
"""What the crops of the worst patch show around it, in its sides."""
GREY = 0.5
"""Behind both crops: the same for truth and asset, so that opacity shows."""

Image = NDArray[np.float32]


@dataclass(frozen=True)
class Rendering:
    """A picture that lets something through.

    Attributes:
        rgb: (H, W, 3) over black.
        alpha: (H, W).
    """

    rgb: Image
    alpha: Image

    @property
    def opacity(self) -> Array:
        """(H, W) in [0, 1]."""
        return np.clip(self.alpha.astype(np.float64), 0, 1)

    def over(self, background: ArrayLike) -> Image:
        """(H, W, 3) over RGB in [0, 1], (3,) or (H, W, 3)."""
        behind: Image = (1 - self.alpha)[..., None] * np.asarray(background, np.float32)
        return self.rgb + behind


@dataclass(frozen=True)
class Cutout:
    """The true subject without what stands behind it.

    Attributes:
        colour: (H, W, 3) times opacity.
        opacity: (H, W) in [0, 1].
        plate: (H, W, 3) what stands behind it in the photo, or None.
    """

    colour: Array
    opacity: Array
    plate: Array | None = None

    @classmethod
    def of(cls, photo: Array, opacity: Array, plate: Array | None) -> Cutout:
        """See `cut_from`."""
        return cls(cut_from(photo, opacity, plate).astype(np.float64, copy=False), opacity, plate)

    def over(self, background: float | Array) -> Array:
        """(H, W, 3) over a grey, or over a picture (H, W, 3)."""
        return np.asarray(self.colour + (1 - self.opacity)[..., None] * background)


def squared_error(rgb: NDArray[np.floating], alpha: Array, truth: Cutout) -> Array:
    """(H, W) mean over the channels and over black, white, mid grey and, where it is known, the plate.

    Args:
        rgb: (H, W, 3) of the rendering, over black.
        alpha: (H, W) its opacity.
    """
    backgrounds: list[float | Array] = [*BACKGROUNDS, *([] if truth.plate is None else [truth.plate])]
    through: Array = (1 - alpha)[..., None]
    errors = [((shown(rgb + through * one) - truth.over(one)) ** 2).mean(-1) for one in backgrounds]
    return np.asarray(np.mean(errors, 0))


@dataclass(frozen=True)
class Patch:
    """The window of a picture in which it is worst.

    Attributes:
        psnr: dB, of the window alone.
        row, column: of its first pixel.
        side: pixels.
    """

    psnr: float
    row: int
    column: int
    side: int


def patch_side(opacity: Array) -> int:
    """Pixels: about an eighth of the subject's size."""
    return max(LEAST_PATCH, round(PATCH_SHARE * float(np.sqrt(opacity.sum()))))


def worst_patch(error: Array, opacity: Array) -> Patch | None:
    """The window with the greatest mean error, weighted with the subject's opacity, of those that it covers by half.

    Args:
        error: (H, W) squared.
        opacity: (H, W) of the true subject.

    Returns:
        None where no window is covered.
    """
    side = min(patch_side(opacity), *error.shape)
    inside = tuple(slice(side // 2, size - (side - 1) // 2) for size in error.shape)
    cover, sums = (uniform_filter(one, side, mode="constant")[inside] for one in (opacity, opacity * error))
    means = np.where(cover >= COVERED, sums / np.maximum(cover, 1e-9), -1.0)
    row, column = np.unravel_index(int(means.argmax()), means.shape)
    worst = float(means[row, column])
    return None if worst < 0 else Patch(decibels(worst), int(row), int(column), side)


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
    place = worst_patch(squared_error(asset.rgb, asset.opacity, truth), truth.opacity)
    if place is None:
        return None
    more = round(AROUND * place.side)
    top, left = max(0, place.row - more), max(0, place.column - more)
    crop = (slice(top, place.row + place.side + more), slice(left, place.column + place.side + more))
    pictures = shown(truth.over(GREY)), shown(asset.over(GREY))
    return WorstPatch(camera, frame, place, pictures[0][crop], pictures[1][crop], (top, left))
