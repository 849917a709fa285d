"""Photos: headers, decoding to 8-bit colour, area downsampling, Multiface's display colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from facefolds_core.errors import UserError
from facefolds_core.files.pictures import FORMATS, DamagedPictureError, open_picture, picture_size
from facefolds_core.files.reading import no_memory

Image = NDArray[np.uint8]
REMEDY = "copy the file again from its source, or take this image out of the capture"


def unreadable(path: Path, place: str, length: int, error: Exception) -> UserError:
    """The error for a file, or data of a file, of so many bytes that no picture can be read of."""
    if isinstance(error, PermissionError):
        return UserError("no permission", file=path, place=place, remedy="give yourself permission to read it")
    found = "an empty file" if length == 0 else f"{length} bytes that are no image ({error})"
    return UserError(
        "cannot read an image", file=path, place=place, expected="a PNG or JPEG image", found=found, remedy=REMEDY
    )


def _open_bytes(data: bytes, file: Path, place: str, formats: Sequence[str]) -> Pillow.Image:
    """A picture's bytes decoded; `file` is where they lie, for messages."""
    try:
        return open_picture(data, formats)
    except MemoryError:
        raise no_memory(file, place) from None
    except (OSError, DamagedPictureError) as error:
        try:
            size = picture_size(data, formats)
        except (OSError, DamagedPictureError) as worse:
            raise unreadable(file, place, len(data), worse) from None
        raise UserError(
            "a damaged image",
            file=file,
            place=place,
            expected=f"{size[0]} x {size[1]} pixels, as its header says",
            found=f"{error} ({len(data)} bytes in the file)",
            remedy=REMEDY,
        ) from None


def _grey_8bit(image: Pillow.Image) -> Image:
    """16-bit (or wider) grey levels -> 8 bits: 65535 becomes 255."""
    return np.round(np.clip(np.asarray(image, dtype=np.float64), 0, 65535) / 257).astype(np.uint8)


def rgb_of(data: bytes, file: Path, place: str, formats: Sequence[str] = FORMATS) -> Image:
    """(H, W, 3) uint8 RGB of a picture's bytes.

    Grey images are repeated over the channels, 16-bit ones reduced to 8, straight alpha is composited over black (the
    background of a capture with transparent images). EXIF rotation is ignored: K refers to the pixels as stored.

    Args:
        file, place: where they lie, for messages.
        formats: of `open_picture`.
    """
    image = _open_bytes(data, file, place, formats)
    if image.mode.startswith("I") or image.mode == "F":
        return np.repeat(_grey_8bit(image)[..., None], 3, axis=2)
    if image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info:
        rgba = np.asarray(image.convert("RGBA"), dtype=np.float64)
        return np.round(rgba[..., :3] * rgba[..., 3:] / 255).astype(np.uint8)
    return np.array(image.convert("RGB"))


def opacity_of(
    data: bytes, file: Path, place: str, formats: Sequence[str] = FORMATS, *, largest: bool = False
) -> Image:
    """(H, W, 1) uint8 opacity of a picture's bytes.

    Args:
        largest: of a colour picture, the largest channel instead of its luma.
    """
    image = _open_bytes(data, file, place, formats)
    if largest and not image.mode.startswith("I"):
        return np.asarray(np.array(image.convert("RGB")).max(2, keepdims=True))
    grey = _grey_8bit(image) if image.mode.startswith("I") else np.array(image.convert("L"))
    return grey[..., None]


def fit_box(width: int, height: int, long_side: int, short_side: int) -> tuple[int, int]:
    """(width, height) of an image shrunk to fit the box, aspect kept to the nearest pixel; never enlarged."""
    scale = min(1.0, long_side / max(width, height), short_side / min(width, height))
    return max(1, round(width * scale)), max(1, round(height * scale))


def downsample(image: Image, width: int, height: int) -> NDArray[np.float32]:
    """Mean of the source pixels that each target pixel covers, fractions included.

    Args:
        image: (H, W, C) uint8.

    Returns:
        (height, width, C) float32 in 0..255.
    """
    values = image.astype(np.float32)
    if image.shape[:2] != (height, width):
        resized = cv2.resize(values, (width, height), interpolation=cv2.INTER_AREA)
        values = np.asarray(resized, np.float32)
    return values.reshape(height, width, image.shape[2])


def display_colour(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Multiface's own display correction of its raw images, which are greenish and dark.

    RGB times (1.4, 1.1, 1.6) / 1.1, minus black 3/255, times 0.95 / (1 - black), to the power 1/2, minus 15/255
    (Multiface's `gammaCorrect`). It comes after the area average, which is thus one of linear light.

    Args:
        values: (H, W, 3), 0..255.

    Returns:
        (H, W, 3), 0..255, clipped.
    """
    black = 3 / 255
    scaled = values / 255 * (np.array([1.4, 1.1, 1.6], np.float32) / 1.1)
    gained = np.clip(scaled - black, 0, 2) * (0.95 / (1 - black))
    return (np.clip(np.sqrt(gained) - 15 / 255, 0, 1) * 255).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Colour:
    """What brings a camera's colours to those of the others: matrix @ RGB + offset, RGB a column in 0..1.

    Attributes:
        matrix: (3, 3).
        offset: (3,).
        linear: whether it is for linear light, else for values on the sRGB curve.
    """

    matrix: NDArray[np.float64]
    offset: NDArray[np.float64]
    linear: bool


def corrected_colour(values: NDArray[np.float32], colour: Colour) -> NDArray[np.float32]:
    """Colours corrected, clipped to 0..1; linear light is reached by the sRGB curve (IEC 61966-2-1) and left by it.

    Args:
        values: (H, W, 3), 0..255.

    Returns:
        (H, W, 3), 0..255.
    """
    matrix, offset = colour.matrix.T.astype(np.float32), colour.offset.astype(np.float32)
    coded = values / np.float32(255)
    if not colour.linear:
        return np.asarray(np.clip(coded @ matrix + offset, 0, 1) * 255, np.float32)
    light = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4).astype(np.float32)
    mixed = np.clip(light @ matrix + offset, 0, 1)
    coded = np.where(mixed <= 0.0031308, mixed * 12.92, 1.055 * mixed ** (1 / 2.4) - 0.055)
    return np.asarray(coded * 255, np.float32)


def to_8bit(values: NDArray[np.float32]) -> Image:
    """Round 0..255 to uint8."""
    rounded = np.round(values)
    return np.clip(rounded, 0, 255, out=rounded).astype(np.uint8)
