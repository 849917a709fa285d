"""Coarser levels of detail, derived from what the full one is made of: fewer vertices, smaller textures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.cropping import Textures, crop_layers
from facefolds_core.asset.writer import LevelContent
from facefolds_core.export.textures import resample
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.params import LevelParams

MOST_KEPT = 768
"""Textures: of 64 frames of 12 layers, so that a long take takes no more memory than a short one."""


class Resampled:
    """Textures at another size, by least squares (export/textures.py); what was asked for last is kept.

    Args:
        most: so many are kept.
    """

    def __init__(self, textures: Textures, size: int, most: int = MOST_KEPT) -> None:
        self._textures, self._size = textures, size
        self._image = lru_cache(most)(self._resampled)

    def image(self, layer: int, frame: int, /) -> NDArray[np.uint8]:
        """(size, size, 4)."""
        return self._image(layer, frame)

    def _resampled(self, layer: int, frame: int) -> NDArray[np.uint8]:
        return resample(self._textures.image(layer, frame), self._size)


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
