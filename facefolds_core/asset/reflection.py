"""A reflection in a file: four pictures in one RGB PNG of 8 bits (docs/reference/asset-format.md)."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.manifest import REMEDY, Level, Reflection
from facefolds_core.asset.manifest_base import Rect
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.geometry.reflections import ReflectionMaps

Codes = NDArray[np.uint8]


@dataclass(frozen=True)
class ReflectionPicture:
    """Maps as they are stored, one below the other: environment, gloss, offset, normals.

    Attributes:
        codes: (height, width, 3) uint8.
        rects: of the four.
        scales: what code 255 means, of the first three; code 0 is 0, of the offset its negative.
        window: (u0, u1, v0, v1) of the last three.
    """

    codes: Codes
    rects: tuple[Rect, Rect, Rect, Rect]
    scales: tuple[float, float, float]
    window: tuple[float, float, float, float]

    @classmethod
    def of(cls, maps: ReflectionMaps) -> ReflectionPicture:
        """Quantise maps and pack them."""
        gloss = np.repeat(maps.gloss[..., None], 3, 2)
        scales = [max(float(np.abs(part).max()), 1e-6) for part in (maps.environment, gloss, maps.offset)]
        coded = [_codes(part / scale * 255) for part, scale in zip((maps.environment, gloss), scales, strict=False)]
        coded += [_codes((part + 1) * 127.5) for part in (maps.offset / scales[2], maps.normals)]
        tops = np.cumsum([0, *(len(part) for part in coded)])
        codes = np.zeros((int(tops[-1]), max(part.shape[1] for part in coded), 3), np.uint8)
        rects: list[Rect] = []
        for top, part in zip(tops, coded, strict=False):
            codes[top : top + len(part), : part.shape[1]] = part
            rects.append((0, int(top), part.shape[1], len(part)))
        environment, gloss_rect, offset, normals = rects
        u0, u1, v0, v1 = (float(x) for x in maps.window)
        return cls(
            codes, (environment, gloss_rect, offset, normals), (scales[0], scales[1], scales[2]), (u0, u1, v0, v1)
        )

    def png(self) -> bytes:
        """The file's bytes."""
        buffer = io.BytesIO()
        Image.fromarray(self.codes).save(buffer, "PNG", optimize=True)
        return buffer.getvalue()


def _codes(values: NDArray[np.float32]) -> Codes:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def read_reflection(folder: Path, level: Level) -> ReflectionMaps | None:
    """The maps of a level; None where it has none.

    Raises:
        UserError: if the picture is damaged.
    """
    entry = level.reflection
    if entry is None:
        return None
    path = folder / entry.file
    try:
        codes = np.asarray(open_picture(path).convert("RGB"), np.float32)
    except (OSError, DamagedPictureError) as error:
        raise UserError("damaged reflection", file=path, found=str(error), remedy=REMEDY) from None
    environment, gloss, offset, normals = (_part(codes, rect) for rect in entry.rects())
    return ReflectionMaps(
        entry.uv_window,
        gloss[..., 0] * np.float32(entry.gloss_scale / 255),
        (offset / np.float32(127.5) - 1) * np.float32(entry.offset_scale),
        normals / np.float32(127.5) - 1,
        environment * np.float32(entry.environment_scale / 255),
    )


def _part(codes: NDArray[np.float32], rect: Rect) -> NDArray[np.float32]:
    x, y, w, h = rect
    return codes[y : y + h, x : x + w]


def reflection_entry(picture: ReflectionPicture, stored: dict[str, object]) -> Reflection:
    """What the manifest says of a picture; `stored` has `file`, `bytes` and `sha256`."""
    height, width = picture.codes.shape[:2]
    environment, gloss, offset, normals = picture.rects
    return Reflection.model_validate(
        {
            **stored,
            "width": width,
            "height": height,
            "uv_window": picture.window,
            "environment_rect": environment,
            "gloss_rect": gloss,
            "offset_rect": offset,
            "normals_rect": normals,
            "environment_scale": picture.scales[0],
            "gloss_scale": picture.scales[1],
            "offset_scale": picture.scales[2],
        }
    )
