"""The yardstick of packaging: rendered training views of what ships against those of what came in.

Quality is counted where an eye sees it, not on texels: rays of some training cameras, in some frames. Held-out cameras
are never looked at.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import Hits, Texture, composite
from facefolds_core.spacing import spread

Image = NDArray[np.float32]

MAX_PSNR = 100.0
"""Of equal pictures, dB."""

CAMERAS = 6
"""Training cameras, evenly spread."""

FRAMES = 3
"""Frames, evenly spread."""

RAYS_PER_CAMERA = 16_000
"""Rays of each camera that hit anything, drawn once."""


class ViewMeter:
    """Measures renderings against a reference along fixed rays.

    Args:
        meshes: of the reference, outermost first.
        cameras: of which some, evenly spaced, are used.
        references: frame -> N textures of the reference.
    """

    def __init__(
        self, meshes: Sequence[TexturedMesh], cameras: Sequence[Camera], references: Mapping[int, Sequence[Texture]]
    ) -> None:
        self._cameras = spread(cameras, CAMERAS)
        rng = np.random.default_rng(0)
        self._pixels: list[NDArray[np.intp]] = []
        hits = []
        for camera in self._cameras:
            cast = cast_layers(camera, meshes)
            self._pixels.append(cast.choose(rng, RAYS_PER_CAMERA))
            hits.append(cast.at(self._pixels[-1]))
        self._hits = Hits.joined(hits)
        self.frames = sorted(references)
        self._reference = {frame: composite(self._hits, references[frame]) for frame in self.frames}

    def hits(self, meshes: Sequence[TexturedMesh]) -> Hits:
        """Where the meter's rays hit other meshes."""
        parts = zip(self._cameras, self._pixels, strict=True)
        return Hits.joined([cast_layers(camera, meshes).at(pixels) for camera, pixels in parts])

    def psnr(self, textures: Iterable[tuple[int, Sequence[Texture]]], hits: Hits | None = None) -> float:
        """dB over all rays and the meter's frames, each ray weighted with the reference's opacity; black background.

        Args:
            textures: (frame, N textures); frames that the meter does not use are passed over.
            hits: of the meshes that carry the textures; by default the reference's.
        """
        error, weight = 0.0, 0.0
        for frame, layers in textures:
            if frame in self._reference:
                rgb, _ = composite(self._hits if hits is None else hits, layers)
                truth, alpha = self._reference[frame]
                difference = ((rgb.astype(np.float64) - truth) ** 2).mean(-1)
                error += float((alpha * difference).sum())
                weight += float(alpha.sum())
        if weight == 0 or error == 0:
            return MAX_PSNR
        return min(MAX_PSNR, -10 * float(np.log10(error / weight)))
