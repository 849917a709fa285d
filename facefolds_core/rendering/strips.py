"""An asset seen from side to side, over several colours: what hems, halos and holes look like."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.reader import Asset
from facefolds_core.rendering.areas import view_of
from facefolds_core.rendering.camera_paths import Eye, camera_of, distance_to_fit

Colour = tuple[float, float, float]


def strip(
    asset: Asset, azimuths: Sequence[float], colours: Sequence[Colour], size: tuple[int, int], field_of_view: float
) -> NDArray[np.uint8]:
    """(rows, columns, 3): a row a colour, a column an azimuth, of the first frame; the whole asset is in each picture.

    Args:
        azimuths: degrees from the front.
        colours: RGB in [0, 1].
        size: width and height of a picture, pixels.
        field_of_view: degrees, of its shorter side.
    """
    box, eyes = asset.manifest.bounds, [Eye(azimuth) for azimuth in azimuths]
    away = 1.0 if box is None else max(1.0, distance_to_fit(box.min, box.max, eyes, *size, field_of_view))
    cameras = [camera_of(Eye(eye.azimuth, distance=away), *size, field_of_view) for eye in eyes]
    textures = asset.frame(0)
    seen = [view_of(asset.full, camera).composite(textures) for camera in cameras]
    rows = [np.hstack([rgb + (1 - alpha[..., None]) * np.array(colour) for rgb, alpha in seen]) for colour in colours]
    return np.asarray(np.rint(255 * np.vstack(rows).clip(0, 1)), np.uint8)
