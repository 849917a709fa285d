"""Levels of detail, derived from what the full one is made of: fewer vertices, smaller textures.

Those of a long take have the full one's meshes and layout, and pictures of fewer pixels. A player changes between them
at a segment's border and keeps all else; a connection's worth of them is all that DASH and HLS know. The layout's cells
are multiples of what the coarsest needs, so that each is the full one's, scaled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.cropping import TextureFrames, crop_layers
from facefolds_core.asset.manifest import Level
from facefolds_core.asset.writer import FULL, LevelContent
from facefolds_core.export.textures import resample
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.packaging.coding import coded_level
from facefolds_core.packaging.settings import level_params
from facefolds_core.packaging.views import ViewMeter
from facefolds_core.params import CompressParams, LevelParams, StreamParams

MOST_KEPT = 768
"""Textures: of 64 frames of 12 layers, so that a long take takes no more memory than a short one."""

COARSEST = 8
"""Times fewer texels a side of a long take's levels than the full one's."""


class Resampled:
    """Textures at another size, by least squares (export/textures.py); what was asked for last is kept.

    Args:
        most: so many are kept.
    """

    def __init__(self, textures: TextureFrames, size: int, most: int = MOST_KEPT) -> None:
        self._image = lru_cache(most)(lambda layer, frame: resample(textures.image(layer, frame), size))

    def image(self, layer: int, frame: int, /) -> NDArray[np.uint8]:
        """(size, size, 4)."""
        return self._image(layer, frame)


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


def is_streamed(params: StreamParams, frames: int, fps: float) -> bool:
    """Whether a sequence is long enough to be a stream."""
    return fps > 0 and frames > 1 and frames / fps > params.beyond


def stream_unit(levels: Sequence[LevelParams], resolution: int) -> int:
    """The largest factor by which a level of a stream is smaller than the full one."""
    return max((_factor(level, resolution) for level in levels), default=1)


def _factor(level: LevelParams, resolution: int) -> int:
    """The power of two that comes to the level's texture resolution, or next above it."""
    factor = 1
    while 2 * factor <= COARSEST and level.texture_resolution * 2 * factor <= resolution:
        if resolution % (2 * factor):
            break
        factor *= 2
    return factor


def write_rungs(
    folder: Path, full: LevelContent, params: CompressParams, meter: ViewMeter | None, cameras: Sequence[Camera]
) -> list[Level]:
    """Write the levels of a stream, coarsest first, the full one last; their key frames are `segment_seconds` apart."""
    interval = max(1, round(params.stream.segment_seconds * full.rate))
    full = replace(full, part_frames=interval)
    finest = coded_level(folder, FULL, full, level_params(params, interval=interval), meter, cameras)
    resolution = full.textures.image(full.layers[0].source, 0).shape[0]
    levels = []
    for level in params.levels:
        content = _smaller(full, _factor(level, resolution), resolution)
        setting = level_params(params, level, interval)
        levels.append(coded_level(folder, level.name, content, setting, meter, cameras, finest))
    together = [*levels, finest]
    return [level.model_copy(update={"switchable": FULL}) for level in together] if levels else together


def _smaller(full: LevelContent, factor: int, resolution: int) -> LevelContent:
    """The same layers in pictures with a `factor`-th of the pixels a side."""
    textures = full.textures if factor == 1 else Resampled(full.textures, resolution // factor, most=0)
    layers = []
    for layer in full.layers:
        x, y, width, height = layer.crop
        crop = x // factor, y // factor, width // factor, height // factor
        layers.append(replace(layer, crop=crop))
    placed, unit = full.layout.scaled(factor), full.unit // factor
    return replace(full, layers=layers, textures=textures, unit=unit, placed=placed)
