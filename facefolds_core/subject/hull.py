"""Where one silhouette contradicts all others: shape from silhouettes (Laurentini 1994), one of them left out.

Dark hair before the dark boards of a shelf does not differ from the plate, so its camera takes it for the room. What
all other cameras cover is then in doubt."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.cameras import Camera

Array = NDArray[np.float32]
Bool = NDArray[np.bool_]

CELLS = 128
"""Places along a side of the cube in which the subject is looked for."""
WITNESSES = 3
"""So many other cameras must cover a place, and none that sees it may not."""
SOLID = 0.95
"""Opacity from which on a pixel shows the subject's colour."""
SPREAD, LEAST = 6.0, 0.01
"""Surroundings whose colours the subject has at a pixel, standard deviation, pixels; where less of them is the
subject's, those of the nearest pixel count."""
DEVIATION, DEVIATIONS = 0.02, 3.0
"""Least standard deviation of these colours; a pixel looks like the subject within so many of them."""


def contradicted(cameras: Sequence[Camera], silhouettes: Sequence[Bool], ball: float) -> list[Bool]:
    """(H, W) of each camera: pixels beyond its silhouette in which a place is seen that all others cover.

    Args:
        silhouettes: (H, W) of the subject, one a camera.
        ball: radius about the origin, units, in which the subject is looked for.
    """
    side = (np.arange(CELLS) + 0.5) * (2 * ball / CELLS) - ball
    places = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3)
    against, covering = np.zeros(len(places), np.int16), np.zeros(len(places), np.int16)
    for camera, silhouette in zip(cameras, silhouettes, strict=True):
        rows, columns, seen = _pixels(camera, places)
        covered = silhouette[rows, columns]
        against += seen & ~covered
        covering += seen & covered
        kept = against < 2
        places, against, covering = places[kept], against[kept], covering[kept]
    places = places[(against == 1) & (covering >= WITNESSES)]
    found = []
    for camera, silhouette in zip(cameras, silhouettes, strict=True):
        rows, columns, seen = _pixels(camera, places)
        image = np.zeros(silhouette.shape, np.uint8)
        image[rows[seen], columns[seen]] = 1
        depth = max(float(camera.w2c[2, 3]), ball)  # one that stands in the ball, or looks away, sees no place larger
        reach = max(1, round(ball / CELLS * camera.K[0, 0] / depth))
        square = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
        found.append(np.asarray((cv2.dilate(image, square) > 0) & ~silhouette))
    return found


def looks_like(picture: Array, opacity: Array) -> Bool:
    """(H, W) where a picture (H, W, 3), in [0, 1], has a colour that the subject, of opacity (H, W), has nearby.

    What few cameras contradict is much of the room; most of it looks otherwise.
    """
    inside = (opacity > SOLID).astype(np.float32)
    weight = _near(inside)
    nearest = ndimage.distance_transform_edt(weight <= LEAST, return_distances=False, return_indices=True)
    mean, square = (
        (_near(one * inside[..., None]) / np.maximum(weight, LEAST)[..., None])[tuple(nearest)]
        for one in (picture, picture**2)
    )
    variance = np.maximum(square - mean**2, 0) + DEVIATION**2
    return np.asarray((np.square(picture - mean) < DEVIATIONS**2 * variance).all(-1))


def _near(values: Array) -> Array:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), SPREAD), np.float32)


def _pixels(camera: Camera, places: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64], Bool]:
    """Rows and columns (P,) of the pixels in which places (P, 3) are seen, and whether they are in the picture."""
    image, depth = camera.project(places)
    columns, rows = np.floor(np.nan_to_num(image)).clip(-1, 1e6).astype(np.int64).T
    seen = (depth > 0) & (columns >= 0) & (rows >= 0) & (columns < camera.width) & (rows < camera.height)
    return np.where(seen, rows, 0), np.where(seen, columns, 0), seen
