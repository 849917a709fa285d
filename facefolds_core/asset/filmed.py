"""Which directions a capture has filmed its subject from: the manifest's `view`; and what lies beyond."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.manifest_extras import FilmedView
from facefolds_core.geometry.cameras import Camera

MOST_MEASURED = 64
"""Cameras that `measured` lists."""

FREE = 4.0
"""Degrees beyond the outermost cameras that are as good as filmed."""

ROUND = 300.0
"""Degrees: cameras that go round so far have filmed from everywhere."""


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


def direction_of(camera: Camera) -> tuple[float, float]:
    """Azimuth and elevation of a camera as seen from the origin, degrees; (0, 0) of one that is at it."""
    azimuth, elevation, _ = _directions([camera])
    return (float(azimuth[0]), float(elevation[0])) if len(azimuth) else (0.0, 0.0)


def degrees_beyond(view: FilmedView, azimuth: float, elevation: float) -> float:
    """How far a direction lies beyond all that was filmed, as seen from the origin; 0 where it is as good as filmed."""
    return max(0.0, *(-side for side in (*_sides(view, azimuth), *_heights(view, elevation))))


def swing_filmed(
    view: FilmedView, azimuth: float, elevation: float, sideways: float, upwards: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """How far a camera may swing and see only what was filmed; all the way where it begins beyond.

    Args:
        sideways, upwards: degrees to each side, at most.

    Returns:
        degrees to the subject's right and left, and down and up.
    """
    if degrees_beyond(view, azimuth, elevation):
        return (sideways, sideways), (upwards, upwards)
    (right, left), (down, up) = _sides(view, azimuth), _heights(view, elevation)
    return (min(sideways, right), min(sideways, left)), (min(upwards, down), min(upwards, up))


def unfilmed_words(view: FilmedView, directions: Sequence[tuple[float, float]]) -> str | None:
    """What to know of pictures from where no camera stood; None where all of them are as good as filmed.

    Args:
        directions: of the pictures: azimuth and elevation, degrees.
    """
    beyond = [found for one in directions if (found := degrees_beyond(view, *one))]
    if not beyond:
        return None
    which = "this looks" if len(directions) == 1 else f"{len(beyond)} of {len(directions)} pictures look"
    (right, left), (low, high) = view.azimuth, view.elevation
    most = f"{max(beyond) + FREE:.0f} degrees beyond the last one{' at most' if len(beyond) > 1 else ''}"
    return (
        f"{which} from where no camera stood, {most}. The asset was filmed from azimuth {right:.0f} to {left:.0f} and "
        f"elevation {low:.0f} to {high:.0f}: there it is whole; from elsewhere it may be hollow, or show what was "
        "made up"
    )


def _sides(view: FilmedView, azimuth: float) -> tuple[float, float]:
    """Degrees from a direction to the ends of what is as good as filmed, on the subject's right and left."""
    low, high = view.azimuth
    if high - low >= ROUND:
        return math.inf, math.inf
    turned = azimuth - 360 * round((azimuth - (low + high) / 2) / 360)
    return turned - low + FREE, high + FREE - turned


def _heights(view: FilmedView, elevation: float) -> tuple[float, float]:
    """The same, below and above."""
    low, high = view.elevation
    return elevation - low + FREE, high + FREE - elevation


def _directions(cameras: Iterable[Camera]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Azimuths and elevations in degrees, and distances, as seen from the origin, of cameras that are not at it."""
    x, y, z = np.array([camera.centre for camera in cameras], np.float64).reshape(-1, 3).T
    distance = np.sqrt(x**2 + y**2 + z**2)
    azimuth, elevation = np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))
    somewhere = distance > 0
    return azimuth[somewhere], elevation[somewhere], distance[somewhere]
