"""Which directions a capture has filmed its subject from: the manifest's `view`."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from facefolds_core.asset.manifest import FilmedView
from facefolds_core.geometry.cameras import Camera


def filmed_view(cameras: Iterable[Camera]) -> FilmedView | None:
    """The smallest arc of azimuths and the range of elevations that hold all cameras, as seen from the origin.

    Args:
        cameras: in normalised coordinates: the subject is at the origin and faces +x.

    Returns:
        degrees; None without cameras. A camera at the origin has no direction and is left out.
    """
    centres = np.array([camera.centre for camera in cameras], np.float64).reshape(-1, 3)
    centres = centres[np.linalg.norm(centres, axis=1) > 0]
    if not len(centres):
        return None
    x, y, z = centres.T
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
    azimuth = np.sort(np.degrees(np.arctan2(y, x)))
    gaps = np.diff(azimuth, append=azimuth[0] + 360)
    widest = int(np.argmax(gaps))
    low = float(azimuth[(widest + 1) % len(azimuth)])
    width = 360 - float(gaps[widest])
    low -= 360 * round((low + width / 2) / 360)  # the arc's middle within half a turn of the front
    rounded = [round(float(angle), 2) for angle in (low, low + width, elevation.min(), elevation.max())]
    return FilmedView(azimuth=(rounded[0], rounded[1]), elevation=(rounded[2], rounded[3]))
