"""How far a picture of Gaussians is from the photo: absolute differences and structure (Wang et al. 2004)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.subject.drawing import Drawing

Array = NDArray[np.float32]

WINDOW, SIGMA = (11, 11), 1.5
SSIM_C1, SSIM_C2 = 0.01**2, 0.03**2
"""As in the scores."""


def picture_loss(drawing: Drawing, photo: Array, background: Array, structure: float) -> tuple[Array, Array]:
    """Derivatives of (1 - structure) mean |C - I| + structure (1 - SSIM of the mean of the colours).

    Args:
        photo: (3, H, W) of whole tiles.
        background: (3, H, W) what is behind, or one colour (3, 1, 1).

    Returns:
        By the colours over black (3, H, W), and by the transmittance (H, W).
    """
    width, height = drawing.view.size
    shown = drawing.rgb + drawing.light * background
    difference = shown - photo
    scale = np.float32(1 / (3 * height * width))
    wish = np.sign(difference) * np.float32((1 - structure) * scale)
    if structure > 0:
        part = slice(0, height), slice(0, width)
        grey = [np.ascontiguousarray(one.mean(0)[part]) for one in (shown, photo)]
        wish[:, part[0], part[1]] -= np.float32(structure * scale) * ssim_gradient(*grey)
    wish[:, height:], wish[:, :, width:] = 0, 0
    return wish, (wish * background).sum(0)


def _smooth(image: NDArray[np.floating]) -> Array:
    return np.asarray(cv2.GaussianBlur(image, WINDOW, SIGMA, borderType=cv2.BORDER_REFLECT_101), np.float32)


def ssim_gradient(x: Array, y: Array) -> Array:
    """Derivative of the sum of SSIM's map by x; (H, W) each."""
    one, two = _smooth(x), _smooth(y)
    a = 2 * one * two + np.float32(SSIM_C1)
    b = 2 * (_smooth(x * y) - one * two) + np.float32(SSIM_C2)
    c = one * one + two * two + np.float32(SSIM_C1)
    d = _smooth(x * x) - one * one + _smooth(y * y) - two * two + np.float32(SSIM_C2)
    value = a * b / (c * d)
    by_square, by_product = -value / d, 2 * a / (c * d)
    by_mean = 2 * two * (b - a) / (c * d) - 2 * one * value * (1 / c - 1 / d)
    return np.asarray(_smooth(by_mean) + 2 * x * _smooth(by_square) + y * _smooth(by_product))
