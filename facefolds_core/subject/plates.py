"""One picture's matte where its camera has a clean plate: what differs from the plate is the subject."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.subject.closed_form import closed_form
from facefolds_core.subject.cut_out import around, filled, grown
from facefolds_core.subject.known_background import PlateParams, opacity_before

Array = NDArray[np.float32]
Image = NDArray[np.uint8]

FAINT = 0.05
"""Opacity of the Gaussians from which on the subject may be there, whatever the plate says."""
SOLID, DEEP = 0.95, 2
"""Opacity of the Gaussians, and pixels within where they have it, from which on the subject is surely there."""
REACH = 4
"""Deviations of `PlateParams.spread` around the subject that still matter to its blurs."""
SAME = 3.0
"""Deviations of noise by which a picture may differ from that of the start where nothing has moved."""


@dataclass(frozen=True)
class Start:
    """What the subject's Gaussians say of a picture. Hair before a shelf of its colour does not differ from the plate.

    Attributes:
        opacity: (H, W) theirs.
        image: (H, W, 3) the camera's picture in the frame in which they were fitted; None of a head that turns.
    """

    opacity: Array
    image: Image | None = None

    def believed(self, image: Image, noise: float, params: PlateParams) -> Array:
        """(H, W) in [0, 1] whether a picture looks as theirs does."""
        assert self.image is not None
        one, two = (
            cv2.GaussianBlur(part.astype(np.float32), (0, 0), params.beside) / 255 for part in (image, self.image)
        )
        return np.asarray(np.exp(-0.5 * np.square(np.abs(one - two).max(-1) / (SAME * noise))), np.float32)


def from_plate(image: Image, plate: Image, params: PlateParams | None = None, start: Start | None = None) -> Array:
    """(H, W) opacity of the subject in [0, 1].

    Args:
        image, plate: (H, W, 3).
        start: what the subject's Gaussians say, once they are known.
    """
    params = params or PlateParams()
    subject = _different(image, plate, params, None if start is None else start.opacity)
    return _soft(image, plate, subject, params, start) if subject.any() else subject.astype(np.float32)


def _different(image: Image, plate: Image, params: PlateParams, opacity: Array | None) -> Image:
    """(H, W) 1 where picture and plate differ, without small things, its holes filled as `filled` says.

    Args:
        opacity: (H, W) of the Gaussians, once they are known.
    """
    one, two = (cv2.GaussianBlur(part.astype(np.float32), (0, 0), params.blur) / 255 for part in (image, plate))
    difference = np.abs(one - two).max(-1)
    # Beyond the picture's border what is cut off goes on: else closing would gnaw at it.
    found = ndimage.binary_closing(np.pad(difference > params.different, 2, mode="edge"), iterations=2)[2:-2, 2:-2]
    labels, count = ndimage.label(filled(found, opacity))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    kept = sizes >= params.least * sizes[1:].max(initial=0)
    kept[0] = False
    return np.asarray(kept[labels], np.uint8)


def _soft(image: Image, plate: Image, subject: Image, params: PlateParams, start: Start | None) -> Array:
    """Opacity along the outline, where the plate is what stands behind; 1 within it."""
    depth = np.asarray(ndimage.distance_transform_edt(np.pad(subject, 1, mode="edge")))[1:-1, 1:-1]
    labels, count = ndimage.label(subject)
    deepest = np.asarray(ndimage.maximum(depth, labels, np.arange(count + 1)))  # of a hand, not of the body beside it
    inside = depth > np.minimum(params.outline, 0.5 * deepest[labels])
    difference = np.abs(image.astype(np.float32) - plate).max(-1) / 255
    quiet = difference[grown(subject, params.quiet) == 0]
    noise = float(np.median(quiet)) if quiet.size else 0.0
    differs = difference > max(params.faint, params.faint_noise * noise)
    unknown = (subject > 0) | (differs & (grown(subject, params.beyond) > 0))
    noise = max(params.noise, noise)
    believed = None
    if start is not None and start.image is not None:
        believed = start.opacity, start.believed(image, noise, params)
        same = believed[1] > 0.5
        unknown |= (start.opacity > FAINT) & (believed[1] > FAINT)
        inside &= ~same | (start.opacity > 0.5)
        inside |= same & (grown((start.opacity < SOLID).astype(np.uint8), DEEP) == 0)
    unknown &= ~inside
    opacity: Array = inside.astype(np.float32)
    if not unknown.any() or not inside.any():
        return opacity
    part = around(inside | unknown, math.ceil(REACH * params.spread))
    colours, room = (one[part].astype(np.float32) / np.float32(255) for one in (image, plate))
    near = None if believed is None else (believed[0][part], believed[1][part])
    before = opacity_before(colours, room, inside[part], unknown[part], noise, params, near)
    weight = np.full(before.shape, params.weight, np.float32)
    opacity[part] = closed_form(colours, inside[part], unknown[part], before, weight)
    return opacity
