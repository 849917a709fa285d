"""PSNR and SSIM of an image against the truth, over the whole frame or weighted by a mask, and the SSIM of high
frequencies: how well fine detail is kept (docs/reference/metrics.md).

Images are (H, W, 3) float64 in [0, 1], in stored (sRGB-encoded) values. SSIM is written out here with separable filters
because torchmetrics' takes seconds an image on a CPU; tests compare the two.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d, gaussian_filter

Array = NDArray[np.float64]

MAX_PSNR = 100.0
"""dB given to images that agree (almost) exactly: infinity is no number in JSON."""

WINDOW_RADIUS = 5
"""SSIM's Gaussian window is 11 x 11."""
WINDOW_SIGMA = 1.5
SSIM_C1, SSIM_C2 = 0.01**2, 0.03**2

HIGH_SIGMA = 2.0
"""Pixels, of the Gaussian whose mean is taken away: what is left is finer than about ten pixels."""
MIDDLE_GREY = 0.5
"""Put in place of that mean: differences have both signs, and SSIM's luminance term is that of equal greys."""


def shown(image: NDArray[np.floating]) -> Array:
    """An image as an 8-bit display shows it: clipped to [0, 1] and rounded to multiples of 1/255."""
    return np.asarray(np.round(np.clip(image, 0, 1) * np.float64(255)) / 255)


def decibels(error: float) -> float:
    """10 log10(1 / MSE) dB of a mean squared error, at most MAX_PSNR."""
    return min(MAX_PSNR, -10 * float(np.log10(max(error, 1e-12))))


def psnr(image: Array, truth: Array, mask: Array | None = None) -> float | None:
    """10 log10(1 / MSE) dB, at most MAX_PSNR; MSE = sum m |I - T|^2 / (3 sum m).

    Args:
        image, truth: (H, W, 3).
        mask: (H, W), m in [0, 1]; None is 1 everywhere.

    Returns:
        None where the mask is empty.
    """
    square = ((image - truth) ** 2).mean(-1)
    if mask is None:
        return decibels(float(square.mean()))
    return decibels(float((mask * square).sum() / mask.sum())) if mask.sum() > 0 else None


def ssim_map(image: Array, truth: Array) -> Array:
    """SSIM (Wang et al. 2004, eq. 13) at each pixel, the mean of the three channels.

    Gaussian window of 11 x 11, sigma 1.5, population moments, C1 = 0.01^2, C2 = 0.03^2; images are mirrored at their
    borders, as torchmetrics does (others leave the outer 5 pixels out, which changes the mean a little).

    Args:
        image, truth: (H, W, 3).

    Returns:
        (H, W).
    """
    mean_x, mean_y = _smooth(image), _smooth(truth)
    variance_x = _smooth(image**2) - mean_x**2
    variance_y = _smooth(truth**2) - mean_y**2
    covariance = _smooth(image * truth) - mean_x * mean_y
    luminance = (2 * mean_x * mean_y + SSIM_C1) / (mean_x**2 + mean_y**2 + SSIM_C1)
    contrast_structure = (2 * covariance + SSIM_C2) / (variance_x + variance_y + SSIM_C2)
    return np.asarray((luminance * contrast_structure).mean(-1))


def ssim(image: Array, truth: Array, mask: Array | None = None) -> float | None:
    """Mean SSIM; with a mask, of the images multiplied by it, weighted by it.

    Args:
        image, truth: (H, W, 3).
        mask: (H, W) in [0, 1]; None is 1 everywhere.

    Returns:
        None where the mask is empty.
    """
    if mask is None:
        return float(ssim_map(image, truth).mean())
    if mask.sum() == 0:
        return None
    values = ssim_map(image * mask[..., None], truth * mask[..., None])
    return float((mask * values).sum() / mask.sum())


def _smooth(image: Array) -> Array:
    """Gaussian mean over the window, (H, W, 3) -> (H, W, 3)."""
    x = np.arange(-WINDOW_RADIUS, WINDOW_RADIUS + 1)
    kernel = np.exp(-0.5 * (x / WINDOW_SIGMA) ** 2)
    kernel /= kernel.sum()
    rows = correlate1d(image, kernel, 0, mode="mirror")
    return np.asarray(correlate1d(rows, kernel, 1, mode="mirror"))


def ssim_high(image: Array, truth: Array, mask: Array | None = None) -> float | None:
    """Mean SSIM of the pictures less their Gaussian means; with a mask, of m I and m T, weighted by m.

    Args:
        image, truth: (H, W, 3) in [0, 1].
        mask: (H, W), m in [0, 1]; None is 1 everywhere.

    Returns:
        None where the mask is empty.
    """
    weight = np.ones(truth.shape[:2]) if mask is None else mask
    if weight.sum() == 0:
        return None
    values = ssim_map(*(high_frequencies(one * weight[..., None]) for one in (image, truth)))
    return float((weight * values).sum() / weight.sum())


def high_frequencies(image: Array) -> Array:
    """(H, W, 3) less the mean by a Gaussian of HIGH_SIGMA, mirrored at the borders, about MIDDLE_GREY."""
    low = gaussian_filter(image, (HIGH_SIGMA, HIGH_SIGMA, 0), mode="mirror")
    return np.asarray(image - low + MIDDLE_GREY)
