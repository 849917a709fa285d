"""What single cameras do differently from the others, told from what the Gaussians show in their pictures: their
exposure and white balance, and whether they look where they are said to look.

Only pixels count that the subject covers: what is behind is no surface that several cameras see alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
Gains = NDArray[np.float64]

MIN_OPACITY = 0.95
"""Of pixels that count."""
MIN_RAYS = 50
"""A camera with fewer of them keeps the gain 1."""
PRIOR = 0.02
"""Uncertainty of colours when gains are fitted, which draws gains towards 1."""
OUTLIER = 2.5
"""Pixels whose residual is beyond so many medians are left out of the second fit."""
MIN_GAIN_SPREAD = 0.03
"""Gains whose standard deviation over cameras is smaller are taken to be 1."""
MAX_ERROR_RATIO = 2.0
"""A camera with an error over so many medians is left out."""


def camera_gains(shown: Array, alpha: Array, seen: Array, camera: NDArray[np.int32], count: int) -> Gains:
    """Gains g of each camera and channel that minimise sum |g shown - seen|^2, robustly; their mean over cameras is 1.

    Args:
        shown: (R, 3) colours of the Gaussians over black.
        alpha: (R,) their opacity.
        seen: (R, 3) pixels.
        camera: (R,) which camera each ray belongs to.
        count: cameras.

    Returns:
        (count, 3).
    """
    gains = np.ones((count, 3))
    for number in range(count):
        chosen = (camera == number) & (alpha > MIN_OPACITY)
        if chosen.sum() < MIN_RAYS:
            continue
        model, pixels = shown[chosen].astype(np.float64), seen[chosen].astype(np.float64)
        kept = np.ones(len(model), bool)
        for _ in range(3):
            a, b = model[kept], pixels[kept]
            prior = PRIOR**2 * len(a)
            gain = ((a * b).sum(0) + prior) / ((a * a).sum(0) + prior)
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
        chosen = (camera == number) & (alpha > MIN_OPACITY)
        if chosen.sum() >= MIN_RAYS:
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
    def of(cls, shown: Array, alpha: Array, seen: Array, camera: NDArray[np.int32], count: int) -> CameraFit:
        """Args: see `camera_gains`."""
        gains = camera_gains(shown, alpha, seen, camera, count)
        return cls(gains, camera_errors(shown, alpha, seen / gains[camera], camera, count))

    @property
    def gains(self) -> Gains:
        """(C, 3) as measured; 1 where the cameras differ so little that it may be the fit's own error."""
        spread = float(self.measured.std(0).max())
        return self.measured if spread > MIN_GAIN_SPREAD else np.ones_like(self.measured)

    @property
    def outliers(self) -> list[int]:
        """Cameras whose error is over MAX_ERROR_RATIO times the median camera's."""
        if np.isnan(self.errors).all():
            return []
        far = self.errors > MAX_ERROR_RATIO * np.nanmedian(self.errors)
        return [int(i) for i in np.flatnonzero(far)]
