"""How well fine detail is kept: the SSIM of high frequencies (docs/reference/metrics.md)."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from facefolds_core.scoring.metrics import Array, ssim_map

HIGH_SIGMA = 2.0
"""Pixels, of the Gaussian whose mean is taken away: what is left is finer than about ten pixels."""
MIDDLE_GREY = 0.5
"""Put in place of that mean: differences have both signs, and SSIM's luminance term is that of equal greys."""


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
