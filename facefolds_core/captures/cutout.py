"""The subject without what stands behind it."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

WIDE, NARROW = 91, 7
"""Pixels, windows of the two passes of blur fusion."""


def cut_from(photo: Array, opacity: Array, plate: Array | None) -> Array:
    """The subject's colours times its opacity, (H, W, 3), of a photo F opacity + (1 - opacity) plate; where nobody
    knows the plate, F is estimated from around.

    Args:
        photo, plate: (H, W, 3) in [0, 1].
        opacity: (H, W) in [0, 1].
    """
    if plate is None:
        return np.asarray(opacity[..., None] * foreground(photo, opacity))
    return np.asarray(np.clip(photo - (1 - opacity)[..., None] * plate, 0, opacity[..., None]))


def foreground(photo: Array, opacity: Array) -> Array:
    """The subject's colours (H, W, 3) in pixels that it half covers: blur fusion (Forte 2021, "Approximate Fast
    Foreground Colour Estimation", eq. 4 and 6), twice."""
    first, behind = _fused(photo, photo, photo, opacity, WIDE)
    return _fused(photo, first, behind, opacity, NARROW)[0]


def _fused(photo: Array, front: Array, behind: Array, opacity: Array, window: int) -> tuple[Array, Array]:
    a = opacity[..., None]

    def mean(image: Array, weight: Array) -> Array:
        total = cv2.blur(weight, (window, window))[..., None]
        return np.asarray(cv2.blur(image * weight[..., None], (window, window)) / np.maximum(total, 1e-5))

    near, far = mean(front, opacity), mean(behind, 1 - opacity)
    return np.clip(near + a * (photo - a * near - (1 - a) * far), 0, 1), far
