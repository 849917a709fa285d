"""View effects in a file: three planes of an RGB PNG, 8 bits (docs/reference/asset-format.md)."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.manifest import REMEDY, Level
from facefolds_core.asset.packing import Rect
from facefolds_core.errors import UserError
from facefolds_core.pictures import DamagedPictureError, open_picture

Map = NDArray[np.float32]
"""(h, w, 3, 3) of one layer: what to add to R, G and B (last axis) for each unit of d_x, d_y and d_z."""

ZERO = 127.5
COVERED = 0.999
"""This part of the coefficients lies within the scale; larger ones are clipped."""


@dataclass(frozen=True)
class EffectsPicture:
    """Maps as they are stored.

    Attributes:
        codes: (3 h, w, 3) uint8, the planes of x, y and z one below the other.
        rects: of each layer within a plane.
        scale: what code 255 means.
    """

    codes: NDArray[np.uint8]
    rects: tuple[Rect, ...]
    scale: float

    @property
    def planes(self) -> tuple[Rect, Rect, Rect]:
        height, width = len(self.codes) // 3, self.codes.shape[1]
        return (0, 0, width, height), (0, height, width, height), (0, 2 * height, width, height)

    @classmethod
    def of(cls, maps: Sequence[Map]) -> EffectsPicture:
        """Quantise maps and pack them."""
        import rpack  # readers do not need it

        largest = float(np.quantile(np.abs(np.concatenate([table.ravel() for table in maps])), COVERED))
        scale = max(largest, 1e-3)
        sizes = [(table.shape[1], table.shape[0]) for table in maps]
        area = sum(w * h for w, h in sizes)
        places = rpack.pack(sizes, max_width=max(max(w for w, _ in sizes), round(area**0.5)))
        width = max(x + w for (x, _), (w, _) in zip(places, sizes, strict=True))
        height = max(y + h for (_, y), (_, h) in zip(places, sizes, strict=True))
        codes = np.full((3, height, width, 3), 128, np.uint8)
        for (x, y), table in zip(places, maps, strict=True):
            coded = np.clip(np.rint(ZERO * (table / scale + 1)), 0, 255).astype(np.uint8)
            codes[:, y : y + table.shape[0], x : x + table.shape[1]] = coded.transpose(2, 0, 1, 3)
        rects = tuple((x, y, w, h) for (x, y), (w, h) in zip(places, sizes, strict=True))
        return cls(codes.reshape(3 * height, width, 3), rects, scale)

    def maps(self) -> tuple[Map, ...]:
        """The maps that a reader gets."""
        return _maps(self.codes, self.planes, self.rects, self.scale)

    def png(self) -> bytes:
        """The file's bytes."""
        buffer = io.BytesIO()
        Image.fromarray(self.codes).save(buffer, "PNG", optimize=True)
        return buffer.getvalue()


def read_effects(folder: Path, level: Level) -> tuple[Map, ...] | None:
    """The maps of a level, one a layer; None where it has none.

    Raises:
        UserError: if the picture is damaged.
    """
    effects = level.view_effects
    if effects is None:
        return None
    path = folder / effects.file
    try:
        codes = np.asarray(open_picture(path).convert("RGB"))
    except (OSError, DamagedPictureError) as error:
        raise UserError("damaged view effects", file=path, found=str(error), remedy=REMEDY) from None
    rects = [layer.effects_rect for layer in level.layers]
    return _maps(codes, effects.planes, [rect for rect in rects if rect is not None], effects.scale)


def _maps(codes: NDArray[np.uint8], planes: Sequence[Rect], rects: Sequence[Rect], scale: float) -> tuple[Map, ...]:
    values = np.asarray((codes / np.float32(ZERO) - 1) * np.float32(scale), np.float32)
    found = []
    for x, y, w, h in rects:
        parts = [values[py + y : py + y + h, px + x : px + x + w] for px, py, _, _ in planes]
        found.append(np.stack(parts, 2))
    return tuple(found)
