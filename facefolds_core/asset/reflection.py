"""A reflection in a file: four pictures in one RGB PNG of 8 bits (docs/reference/asset-format.md)."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from facefolds_core.asset.manifest import REMEDY, Level
from facefolds_core.asset.stored import refuse_changed
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.geometry.reflections import ReflectionMaps


def pack_reflection(maps: ReflectionMaps) -> tuple[bytes, dict[str, Any]]:
    """A PNG of the maps, one below the other, and what `Reflection` says of it beside the file.

    Code 255 means a map's scale, code 0 is 0, or its negative where values have signs; of normals the scale is 1.
    """
    gloss = np.repeat(maps.gloss[..., None], 3, 2)
    parts = {"environment": maps.environment, "gloss": gloss, "offset": maps.offset, "normals": maps.normals}
    said: dict[str, Any] = {"uv_window": tuple(float(x) for x in maps.window)}
    coded, top = [], 0
    for name, part in parts.items():
        if name != "normals":
            said[f"{name}_scale"] = scale = max(float(np.abs(part).max()), 1e-6)
            part = part / scale
        values = part * 255 if name in ("environment", "gloss") else (part + 1) * 127.5
        coded.append(np.clip(np.rint(values), 0, 255).astype(np.uint8))
        said[f"{name}_rect"] = (0, top, part.shape[1], len(part))
        top += len(part)
    codes = np.zeros((top, max(part.shape[1] for part in coded), 3), np.uint8)
    for (_, y, w, h), part in zip((said[f"{name}_rect"] for name in parts), coded, strict=True):
        codes[y : y + h, :w] = part
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, "PNG", optimize=True)
    return buffer.getvalue(), said | {"width": codes.shape[1], "height": top}


def read_reflection(folder: Path, level: Level) -> ReflectionMaps | None:
    """The maps of a level; None where it has none.

    Raises:
        UserError: if the picture is not (or no longer) the manifest's, or damaged.
    """
    entry = level.reflection
    if entry is None:
        return None
    refuse_changed(folder, entry)
    path = folder / entry.file
    try:
        codes = np.asarray(open_picture(path).convert("RGB"), np.float32)
    except (OSError, DamagedPictureError) as error:
        raise UserError("damaged reflection", file=path, found=str(error), remedy=REMEDY) from None
    environment, gloss, offset, normals = (codes[y : y + h, x : x + w] for x, y, w, h in entry.rects())
    return ReflectionMaps(
        entry.uv_window,
        gloss[..., 0] * np.float32(entry.gloss_scale / 255),
        (offset / np.float32(127.5) - 1) * np.float32(entry.offset_scale),
        normals / np.float32(127.5) - 1,
        environment * np.float32(entry.environment_scale / 255),
    )
