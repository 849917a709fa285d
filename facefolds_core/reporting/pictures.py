"""Pictures as data URIs: WebP for photos, PNG with a palette for error maps."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.record import View
from facefolds_core.scoring.sheets import ERROR_COLOURS, MAX_ERROR

PHOTO_QUALITY = 88
TEXTURE_QUALITY = 80
ERROR_STEPS = 64
"""Colours of an error map."""


def photo(image: Array) -> str:
    """(H, W, 3) in [0, 1] -> WebP."""
    return _encode(Image.fromarray(_bytes(image)), "webp", quality=PHOTO_QUALITY, method=4)


def exact(image: Array) -> str:
    """(H, W, 3) in [0, 1] -> PNG: small crops, shown large."""
    return _encode(Image.fromarray(_bytes(image)), "png", optimize=True)


def texture(rgba: NDArray[np.uint8], longest: int) -> str:
    """(H, W, 4) straight alpha -> WebP with alpha, at most `longest` pixels a side."""
    image = Image.fromarray(rgba)
    image.thumbnail((longest, longest), Image.Resampling.LANCZOS)
    return _encode(image, "webp", quality=TEXTURE_QUALITY, method=4)


def error_map(image: Array, truth: Array, mask: Array | None) -> str:
    """Mean absolute error of R, G and B, weighted with the mask where there is one, in the contact sheet's colours."""
    error = np.abs(image - truth).mean(-1) * (1 if mask is None else mask)
    steps = np.round(np.clip(error / MAX_ERROR, 0, 1) * (ERROR_STEPS - 1)).astype(np.uint8)
    picture = Image.fromarray(steps, "P")
    picture.putpalette(_bytes(error_colours(ERROR_STEPS)).tobytes())
    return _encode(picture, "png", optimize=True)


def error_colours(count: int) -> Array:
    """(count, 3) in [0, 1], from no error to MAX_ERROR and more."""
    return np.asarray(colormaps[ERROR_COLOURS](np.linspace(0, 1, count))[:, :3])


def film(path: Path) -> str:
    """An MP4 as it is."""
    return f"data:video/mp4;base64,{base64.b64encode(path.read_bytes()).decode()}"


def jpeg(path: Path) -> str:
    """A JPEG as it is."""
    return f"data:image/jpeg;base64,{base64.b64encode(path.read_bytes()).decode()}"


def _bytes(image: Array) -> NDArray[np.uint8]:
    return np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)


def _encode(image: Image.Image, kind: str, **options: int | bool) -> str:
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"


def as_scored(view: View) -> Array:
    """(H, W, 3) the asset to be held against the photo: over the clean plate, else within the mask and the photo around
    it, so that what differs is what was scored."""
    if view.over is not None or view.mask is None:
        return view.asset if view.over is None else view.over
    inside = view.mask[..., None]
    return np.asarray(inside * view.asset + (1 - inside) * view.truth)
