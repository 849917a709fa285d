"""How near a matte comes to the true one, and where a mask's interior and outline are (docs/reference/metrics.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_gradient_magnitude

from facefolds_core.scoring.metrics import Array

Region = NDArray[np.bool_]

THOUSAND = 1000.0
"""Sums over pixels are given in thousands, as the field does (Rhemann et al. 2009)."""
GRADIENT_SIGMA = 1.4
"""Pixels, of the Gaussian derivative (Rhemann et al. 2009)."""
INSIDE = 0.5
BAND = 4.0
"""Pixels to both sides of the outline that are scored apart."""


def matte_errors(alpha: Array, mask: Array) -> dict[str, float]:
    """Errors of a matte (Rhemann et al. 2009), over the whole frame: there is no trimap.

    Args:
        alpha, mask: (H, W) opacity in [0, 1], found and true.

    Returns:
        `matte_sad`: sum |alpha - m| / 1000; `matte_mse`: mean (alpha - m)^2; `matte_gradient`: sum (|grad alpha| -
        |grad m|)^2 / 1000; `matte_iou`: of the pixels that are more than half opaque, 1 where there are none in either.
    """
    difference = alpha - mask
    slopes = [gaussian_gradient_magnitude(one, GRADIENT_SIGMA, mode="nearest") for one in (alpha, mask)]
    found, true = alpha > INSIDE, mask > INSIDE
    union = int((found | true).sum())
    return {
        "matte_sad": float(np.abs(difference).sum()) / THOUSAND,
        "matte_mse": float((difference**2).mean()),
        "matte_gradient": float(((slopes[0] - slopes[1]) ** 2).sum()) / THOUSAND,
        "matte_iou": int((found & true).sum()) / union if union else 1.0,
    }


def interior_and_band(mask: Array, pixels: float = BAND) -> tuple[Region, Region]:
    """Where a mask is left after erosion by a disc, and what lies between its erosion and its dilation.

    The frame's edge is no outline: a bust that it cuts is not eroded there.

    Args:
        mask: (H, W) opacity; the subject is where it is more than half.
        pixels: radius of the disc.

    Returns:
        (H, W) each.
    """
    subject = mask > INSIDE
    if subject.all() or not subject.any():
        return subject, np.zeros_like(subject)
    interior = distance_transform_edt(subject) > pixels
    dilated = distance_transform_edt(~subject) <= pixels
    return interior, dilated & ~interior


def opacity_errors(alpha: Array, mask: Array) -> dict[str, float | None]:
    """Mean |alpha - m| inside the outline, along it and outside (`interior_and_band`); None where there is no pixel.

    Args:
        alpha, mask: (H, W) opacity in [0, 1], found and true.
    """
    interior, band = interior_and_band(mask)
    parts = {"inside": interior, "edge": band, "outside": ~(interior | band)}
    error = np.abs(alpha - mask)
    return {f"opacity_{name}": float(error[part].mean()) if part.any() else None for name, part in parts.items()}
