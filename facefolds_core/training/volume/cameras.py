"""What single cameras do differently from the others, told from what the volume shows on their rays: their exposure
and white balance, and whether they look where they are said to look.

Only rays count on which the volume is nearly opaque: what is behind is no surface that several cameras see alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
Gains = NDArray[np.float64]

SURE = 0.95
"""Least opacity of the rays that count."""

LEAST_RAYS = 50
"""A camera with fewer such rays keeps the gain 1."""

DARK = 0.02
"""Colours are taken to be uncertain by this much when the gains are fitted: it draws gains towards 1, those of dark
subjects most."""

OUTLIER = 2.5
"""Rays with a residual larger than this many times the camera's median are left out of the second fit: silhouettes,
highlights, hair."""

NOTICED = 0.03
"""Standard deviation of the gains over cameras below which they are taken to be all 1."""

FAR = 2.0
"""A camera whose error is so many times the median camera's is left out."""


def camera_gains(shown: Array, alpha: Array, seen: Array, camera: NDArray[np.int32], count: int) -> Gains:
    """Gains g of each camera and channel that minimise sum |g shown - seen|^2, robustly; their mean over cameras is 1.

    Args:
        shown: (R, 3) colours of the volume over black.
        alpha: (R,) its opacity.
        seen: (R, 3) pixels.
        camera: (R,) which camera each ray belongs to.
        count: cameras.

    Returns:
        (count, 3).
    """
    gains = np.ones((count, 3))
    for number in range(count):
        chosen = (camera == number) & (alpha > SURE)
        if chosen.sum() < LEAST_RAYS:
            continue
        model, pixels = shown[chosen].astype(np.float64), seen[chosen].astype(np.float64)
        kept = np.ones(len(model), bool)
        for _ in range(3):
            a, b = model[kept], pixels[kept]
            gain = ((a * b).sum(0) + DARK**2 * len(a)) / ((a * a).sum(0) + DARK**2 * len(a))
            residual = np.linalg.norm(gain * model - pixels, axis=1)
            kept = residual <= OUTLIER * np.median(residual) + 1e-9
        gains[number] = gain
    normalised: Gains = gains / gains.mean(0)
    return normalised


def camera_errors(
    shown: Array, alpha: Array, seen: NDArray[np.floating], camera: NDArray[np.int32], count: int
) -> Gains:
    """(count,) root of the mean squared colour distance on the rays that count; NaN for a camera with too few."""
    errors = np.full(count, np.nan)
    square = ((shown.astype(np.float64) - seen) ** 2).sum(1)
    for number in range(count):
        chosen = (camera == number) & (alpha > SURE)
        if chosen.sum() >= LEAST_RAYS:
            errors[number] = np.sqrt(square[chosen].mean())
    return errors


@dataclass(frozen=True)
class CameraFit:
    """Gains and errors of C training cameras.

    Attributes:
        measured: (C, 3) gain of each camera and channel, mean 1 over cameras.
        errors: (C,) see `camera_errors`, with gains taken out; NaN for cameras that see too little.
    """

    measured: Gains
    errors: Gains

    @classmethod
    def alike(cls, count: int) -> CameraFit:
        """Nothing known yet: all cameras alike."""
        return cls(np.ones((count, 3)), np.full(count, np.nan))

    @property
    def gains(self) -> Gains:
        """(C, 3) as measured; 1 where the cameras differ so little that it may be the fit's own error."""
        return self.measured if float(self.measured.std(0).max()) > NOTICED else np.ones_like(self.measured)

    @property
    def outliers(self) -> list[int]:
        """Cameras whose error is FAR times the median camera's or more."""
        if np.isnan(self.errors).all():
            return []
        far = self.errors > FAR * np.nanmedian(self.errors)
        return [int(i) for i in np.flatnonzero(far)]

    def corrected(self, colours: Array, camera: NDArray[np.int32]) -> Array:
        """(R, 3) pixels as the mean camera would have seen them."""
        return (colours / self.gains[camera]).astype(np.float32)

    def refined(self, shown: Array, alpha: Array, corrected: Array, camera: NDArray[np.int32]) -> CameraFit:
        """What is left in pixels that were corrected already goes on top."""
        count = len(self.measured)
        left = camera_gains(shown, alpha, corrected, camera, count)
        measured = self.gains * left
        return CameraFit(
            measured / measured.mean(0), camera_errors(shown, alpha, corrected / left[camera], camera, count)
        )
