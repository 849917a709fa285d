"""The asset's poster: the web player's own first picture, so that nothing jumps when the one replaces the other."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from PIL import Image

from facefolds_core.asset.manifest import Bounds
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.areas import view_of
from facefolds_core.rendering.camera_paths import Eye, camera_of

FIELD_OF_VIEW, FILLED = 30.0, 0.92
"""Of the player's first view (viewer/src/view.js): degrees, and how much of a square the longer side takes."""
BACKGROUND = (22 / 255, 24 / 255, 29 / 255)
"""The player's own (viewer/src/element.js), #16181d."""
JPEG_QUALITY = 92
"""Of poster and photos, on JPEG's scale."""
MARGIN = 1.1
"""Picture beyond that square, for what stands nearer than the box's middle."""


def home_camera(bounds: Bounds, side: int) -> Camera:
    """What the player begins with, before the face, at eye level; its picture has the shape of the box.

    Args:
        side: pixels of the picture's longer side.
    """
    low, high = np.array(bounds.min), np.array(bounds.max)
    centre = (low + high) / 2
    _, across, tall = high - low
    longer = max(across, tall)
    away = longer / (2 * math.tan(math.radians(FIELD_OF_VIEW) / 2) * FILLED)
    eye = Eye(distance=away + 0.5 * (high[0] - centre[0]), target=tuple(centre.tolist()))
    square = camera_of(eye, 1, 1, FIELD_OF_VIEW)
    width, height = (max(2, round(side * size / longer)) for size in (across, tall))
    focal = side / MARGIN * square.K[0, 0]
    K = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    return Camera("poster", K, square.w2c, width, height)


def write_poster(path: Path, level: AssetLevel, bounds: Bounds, side: int) -> Camera:
    """Frame 0 of a level with its reflection, over `BACKGROUND`: a JPEG. Returns its camera, in the world.

    Args:
        bounds: of the asset.
        side: pixels of the picture's longer side.
    """
    camera = home_camera(bounds, side)
    rgb, _ = view_of(level, camera).composite(level.frame(0), BACKGROUND)
    Image.fromarray(np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8)).save(path, quality=JPEG_QUALITY)
    return camera
