"""Coarser levels of detail, derived from what the full one is made of: fewer vertices, smaller textures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.cropping import Textures, crop_layers
from facefolds_core.asset.writer import LevelContent
from facefolds_core.export.textures import resample
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.params import CompressParams, LevelParams

MOST_KEPT = 1024
"""Textures: of some hundred frames, so that a long take does not fill the memory."""


class Resampled:
    """Textures at another size, by least squares (export/textures.py); what was asked for last is kept."""

    def __init__(self, textures: Textures, size: int) -> None:
        self._textures, self._size = textures, size
        self._kept: dict[tuple[int, int], NDArray[np.uint8]] = {}

    def image(self, layer: int, frame: int, /) -> NDArray[np.uint8]:
        """(size, size, 4)."""
        key = layer, frame
        if key not in self._kept:
            if len(self._kept) >= MOST_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = resample(self._textures.image(layer, frame), self._size)
        return self._kept[key]


def coarse_content(
    full: LevelContent, windows: Sequence[Window], level: LevelParams, meshes: Sequence[TexturedMesh]
) -> LevelContent:
    """What a coarser level shows.

    Args:
        windows, meshes: of all layers of the export; the meshes as coarse as the level asks for.
    """
    # Never as fine as the full one's, whose picture would be as large.
    size = min(level.texture_resolution, 3 * full.textures.image(0, 0).shape[0] // 4)
    textures = Resampled(full.textures, size)
    layers = crop_layers(meshes, windows, textures, full.frames)
    return LevelContent(layers, textures, full.frames, full.fps)


def level_params(params: CompressParams, level: LevelParams) -> CompressParams:
    """The codecs' settings of a coarser level."""
    video = params.video.model_copy(update={"crf": level.crf, "target_psnr": None, "lossless": False})
    mesh = params.mesh
    if level.max_error_pixels is not None:
        mesh = mesh.model_copy(
            update={"max_error_pixels": level.max_error_pixels, "compression_level": max(mesh.compression_level, 7)}
        )
    return params.model_copy(update={"video": video, "mesh": mesh})
