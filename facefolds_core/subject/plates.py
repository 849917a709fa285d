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
from facefolds_core.subject.known_background import BESIDE, NOISE, SPREAD, opacity_before

Array = NDArray[np.float32]
Image = NDArray[np.uint8]

BLUR = 0.7
"""Of picture and plate before they are compared, standard deviation, pixels."""
DIFFERENT = 0.05
"""Difference of a colour, in [0, 1], above which a pixel may be the subject's."""
LEAST = 0.05
"""Things smaller than this share of the largest are taken for shadows or reflections."""
OUTLINE, BEYOND = 8, 6
"""Pixels inside and outside of the outline within which opacity is found from colours."""
LITTLE, LITTLE_NOISE = 0.012, 2.5
"""Least difference of a colour that shows a little of the subject beyond the outline; least value of it in multiples of
the pictures' noise."""
QUIET = 12
"""Noise is measured at least so many pixels beyond the outline."""
WEIGHT = 1.0
"""Of the opacity that is expected by colours, beside the differences from its neighbours' in the closed form."""
FAINT = 0.05
"""Opacity of the Gaussians from which on the subject may be there, whatever the plate says."""
SOLID, DEEP = 0.95, 2
"""Opacity of the Gaussians, and pixels within where they have it, from which on the subject is surely there."""
REACH = 4
"""Deviations of `SPREAD` around the subject that still matter to its blurs."""
SAME = 3.0
"""Deviations of noise by which a picture may differ from what the Gaussians show where these are believed."""


@dataclass(frozen=True)
class Expectation:
    """What the subject's Gaussians say of a picture. Hair before a shelf of its colour does not differ from the plate.

    Attributes:
        opacity: (H, W) theirs.
        image: (H, W, 3) what they show over the plate.
    """

    opacity: Array
    image: Image

    def believed(self, image: Image, noise: float) -> Array:
        """(H, W) in [0, 1] whether a picture looks as theirs does."""
        one, two = (cv2.GaussianBlur(part.astype(np.float32), (0, 0), BESIDE) / 255 for part in (image, self.image))
        return np.asarray(np.exp(-0.5 * np.square(np.abs(one - two).max(-1) / (SAME * noise))), np.float32)


def from_plate(image: Image, plate: Image, start: Expectation | None = None) -> Array:
    """(H, W) opacity of the subject in [0, 1].

    Args:
        image, plate: (H, W, 3).
        start: what the subject's Gaussians say, once they are known.
    """
    subject = _different(image, plate, None if start is None else start.opacity)
    return _soft(image, plate, subject, start) if subject.any() else subject.astype(np.float32)


def _different(image: Image, plate: Image, opacity: Array | None) -> Image:
    """(H, W) 1 where picture and plate differ, without small things, its holes filled as `filled` says.

    Args:
        opacity: (H, W) of the Gaussians, once they are known.
    """
    one, two = (cv2.GaussianBlur(part.astype(np.float32), (0, 0), BLUR) / 255 for part in (image, plate))
    difference = np.abs(one - two).max(-1)
    # Beyond the picture's border what is cut off goes on: else closing would gnaw at it.
    found = ndimage.binary_closing(np.pad(difference > DIFFERENT, 2, mode="edge"), iterations=2)[2:-2, 2:-2]
    labels, count = ndimage.label(filled(found, opacity))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    kept = sizes >= LEAST * sizes[1:].max(initial=0)
    kept[0] = False
    return np.asarray(kept[labels], np.uint8)


def _soft(image: Image, plate: Image, subject: Image, start: Expectation | None) -> Array:
    """Opacity along the outline, where the plate is what stands behind; 1 within it."""
    depth = np.asarray(ndimage.distance_transform_edt(np.pad(subject, 1, mode="edge")))[1:-1, 1:-1]
    labels, count = ndimage.label(subject)
    deepest = np.asarray(ndimage.maximum(depth, labels, np.arange(count + 1)))  # of a hand, not of the body beside it
    inside = depth > np.minimum(OUTLINE, 0.5 * deepest[labels])
    difference = np.abs(image.astype(np.float32) - plate).max(-1) / 255
    quiet = difference[grown(subject, QUIET) == 0]
    noise = float(np.median(quiet)) if quiet.size else 0.0
    differs = difference > max(LITTLE, LITTLE_NOISE * noise)
    unknown = (subject > 0) | (differs & (grown(subject, BEYOND) > 0))
    noise = max(NOISE, noise)
    believed = None
    if start is not None:
        believed = start.opacity, start.believed(image, noise)
        same = believed[1] > 0.5
        unknown |= (start.opacity > FAINT) & (believed[1] > FAINT)
        inside &= ~same | (start.opacity > 0.5)
        inside |= same & (grown((start.opacity < SOLID).astype(np.uint8), DEEP) == 0)
    unknown &= ~inside
    opacity: Array = inside.astype(np.float32)
    if not unknown.any() or not inside.any():
        return opacity
    part = around(inside | unknown, math.ceil(REACH * SPREAD))
    colours, room = (one[part].astype(np.float32) / np.float32(255) for one in (image, plate))
    near = None if believed is None else (believed[0][part], believed[1][part])
    before = opacity_before(colours, room, inside[part], unknown[part], noise, near)
    weight = np.full(before.shape, WEIGHT, np.float32)
    opacity[part] = closed_form(colours, inside[part], unknown[part], before, weight)
    return opacity
