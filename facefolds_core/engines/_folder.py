"""What exporters share that write a folder with a picture a frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.colour import luma_to_alpha, yuv420_to_rgb
from facefolds_core.asset.manifest import Texture
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.asset.video import Picture, planes
from facefolds_core.errors import UserError


def rgb_picture(picture: Picture, texture: Texture) -> NDArray[np.uint8]:
    """A decoded picture -> (height, width, 3) RGB: colour in its half, alpha as grey in its own."""
    y, cb, cr = planes(picture)
    rgb = yuv420_to_rgb(y, cb, cr)
    x0, y0, w, h = texture.alpha_rect
    rgb[y0 : y0 + h, x0 : x0 + w] = luma_to_alpha(y[y0 : y0 + h, x0 : x0 + w])[..., None]
    return rgb


def in_words(level: AssetLevel, place: Path) -> str:
    """What was written to a file or folder."""
    size = sum(path.stat().st_size for path in (place, *place.rglob("*")) if path.is_file())
    return f"{level.num_layers} layers, {level.num_frames} frames, {size / 1e6:.1f} MB"


def refuse_other_content(folder: Path, mark: str) -> None:
    """Raise UserError unless the folder may be replaced: not there, empty, or an earlier export, which has `mark`."""
    if folder.is_file():
        raise UserError("a file stands where the folder is to be", file=folder, remedy="name another folder")
    if folder.exists() and any(folder.iterdir()) and not (folder / mark).is_file():
        raise UserError(
            "the folder is not empty, and holds no earlier export",
            file=folder,
            expected=f"no such folder, or one with {mark}",
            remedy="name another folder",
        )
