"""The texture video's pictures as ordinary ones, for exporters that store a picture a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.colour import luma_to_alpha, yuv420_to_rgb
from facefolds_core.asset.manifest import Texture
from facefolds_core.asset.video import Picture


def rgb_picture(picture: Picture, texture: Texture) -> NDArray[np.uint8]:
    """A decoded picture -> (height, width, 3) RGB: colour in its half, alpha as grey in its own."""
    height, width = texture.height, texture.width
    y = picture[:height]
    cb, cr = picture[height:].reshape(2, height // 2, width // 2)
    rgb = yuv420_to_rgb(y, cb, cr)
    x0, y0, w, h = texture.alpha_rect
    rgb[y0 : y0 + h, x0 : x0 + w] = luma_to_alpha(y[y0 : y0 + h, x0 : x0 + w])[..., None]
    return rgb
