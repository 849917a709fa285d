"""Which directions a capture has filmed its subject from: the manifest's `view`."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.manifest_extras import FilmedView
from facefolds_core.geometry.cameras import Camera

MOST_MEASURED = 64
"""Cameras that `measured` lists."""


def filmed_view(cameras: Iterable[Camera], measured: Iterable[Camera] = ()) -> FilmedView | None:
    """The smallest arc of azimuths and the range of elevations that hold all cameras, as seen from the origin.

    Args:
        cameras: in normalised coordinates: the subject is at the origin and faces +x.
        measured: cameras that training does not see and that quality is measured with; some of very many.

    Returns:
        degrees; None without cameras. A camera at the origin has no direction and is left out.
    """
    azimuths, elevation, distance = _directions(cameras)
    if not len(distance):
        return None
    azimuth = np.sort(azimuths)
    gaps = np.diff(azimuth, append=azimuth[0] + 360)
    widest = int(np.argmax(gaps))
    low = float(azimuth[(widest + 1) % len(azimuth)])
    width = 360 - float(gaps[widest])
    low -= 360 * round((low + width / 2) / 360)  # the arc's middle within half a turn of the front
    unseen = np.stack(_directions(measured), -1)
    unseen = unseen[:: -(-len(unseen) // MOST_MEASURED) or 1]
    return FilmedView(
        azimuth=(round(low, 2), round(low + width, 2)),
        elevation=(round(float(elevation.min()), 2), round(float(elevation.max()), 2)),
        distance=(round(float(distance.min()), 4), round(float(distance.max()), 4)),
        measured=tuple((round(a, 2), round(e, 2), round(d, 4)) for a, e, d in unseen.tolist()) or None,
    )


def _directions(cameras: Iterable[Camera]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Azimuths and elevations in degrees, and distances, as seen from the origin, of cameras that are not at it."""
    x, y, z = np.array([camera.centre for camera in cameras], np.float64).reshape(-1, 3).T
    distance = np.sqrt(x**2 + y**2 + z**2)
    azimuth, elevation = np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))
    somewhere = distance > 0
    return azimuth[somewhere], elevation[somewhere], distance[somewhere]
