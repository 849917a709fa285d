"""Pictures and films as data URIs."""

from __future__ import annotations

import base64
import io
from mimetypes import guess_type
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.files.reading import remake

QUALITY = 85
"""Of WebP."""
SHEET = (2600, 16_000)
"""Pixels that the contact sheet has at most."""


def sheet(path: Path) -> str:
    """A large PNG -> WebP.

    Raises:
        UserError: if it is damaged.
    """
    try:
        picture = open_picture(path)
    except (OSError, DamagedPictureError) as error:
        message = "a picture of the evaluation is damaged"
        raise UserError(message, file=path, found=str(error), remedy=remake(path)) from None
    return _webp(picture, SHEET)


def texture(rgba: NDArray[np.uint8], longest: int) -> str:
    """(H, W, 4) straight alpha -> WebP with alpha, at most `longest` pixels a side."""
    return _webp(Image.fromarray(rgba), (longest, longest))


def stored(path: Path) -> str:
    """A file as it is."""
    return f"data:{guess_type(path.name)[0]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def _webp(image: Image.Image, most: tuple[int, int]) -> str:
    image.thumbnail(most, Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    image.save(buffer, "webp", quality=QUALITY, method=4)
    return f"data:image/webp;base64,{base64.b64encode(buffer.getvalue()).decode()}"
