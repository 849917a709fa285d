"""One picture's matte where its camera has a clean plate: what differs from the plate is the subject."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.params import PlateParams
from facefolds_core.training.mattes.cut_out import grown

Array = NDArray[np.float32]
Image = NDArray[np.uint8]


def from_plate(image: Image, plate: Image, params: PlateParams) -> Array:
    """(H, W) opacity of the subject in [0, 1].

    Args:
        image, plate: (H, W, 3).
    """
    subject = _different(image, plate, params)
    return _soft(image, plate, subject, params) if subject.any() else subject.astype(np.float32)


def _different(image: Image, plate: Image, params: PlateParams) -> Image:
    """(H, W) 1 where picture and plate differ, without holes and small things."""
    one, two = (cv2.GaussianBlur(part.astype(np.float32), (0, 0), params.blur) / 255 for part in (image, plate))
    difference = np.abs(one - two).max(-1)
    found = ndimage.binary_closing(difference > params.different, iterations=2)
    labels, count = ndimage.label(ndimage.binary_fill_holes(found))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    kept = sizes >= params.least * sizes[1:].max(initial=0)
    kept[0] = False
    return np.asarray(kept[labels], np.uint8)


def _soft(image: Image, plate: Image, subject: Image, params: PlateParams) -> Array:
    """I = a F + (1 - a) P around the outline, F the nearest of the subject's own colours, by least squares of RGB."""
    inside = cv2.erode(subject, np.ones((2 * params.outline + 1,) * 2, np.uint8), borderValue=1) > 0
    if not inside.any():
        return subject.astype(np.float32)
    colours, room = image.astype(np.float32) / 255, plate.astype(np.float32) / 255
    blur = 0.5 * max(1, params.outline)
    weight = cv2.GaussianBlur(inside.astype(np.float32), (0, 0), blur)[..., None]
    own = cv2.GaussianBlur(colours * inside[..., None], (0, 0), blur) / np.maximum(weight, 1e-3)
    nearest = ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
    across = own[tuple(nearest)] - room
    least = max(3 * params.contrast**2, 1e-12)  # where both are the same colour nothing is divided by 0
    opacity = ((colours - room) * across).sum(-1) / np.maximum((across**2).sum(-1), least)
    opacity = np.where(grown(subject, params.beyond) > 0, np.clip(opacity, 0, 1), 0)
    return np.where(inside, 1, opacity).astype(np.float32)
