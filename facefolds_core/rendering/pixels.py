"""The pixel filter of pictures: each pixel the mean over its square, by SIDE x SIDE rays. Slow and plain, by Embree.

`areas` does the same, compiled, and keeps what serves several frames; one ray a pixel is `reference.composite`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.reference import BLACK, AssetCaster, Hits, Layered, composite, room_from, seen_from
from facefolds_core.rendering.reflection import reflected_colours

Image = NDArray[np.float32]
Lit = tuple[Hits, Sequence[Image] | None]
"""Hits, and for each layer what a reflection adds to the colours there; None for nothing."""

SIDE = 2
"""Rays along each side of a pixel: see `docs/reference/metrics.md`, "areas", for how it was chosen."""

ROWS_AT_ONCE = 64
"""Rows of pixels that are cast together: bounds the memory."""


def finer(camera: Camera, side: int = SIDE) -> Camera:
    """The camera of a picture `side` times as large: its rays through pixel centres are those of the areas."""
    return camera.resized(side * camera.width, side * camera.height)


def pixel_means(image: Image, side: int = SIDE) -> Image:
    """(side H, side W, ...) -> (H, W, ...): the mean of each pixel's rays."""
    height, width = image.shape[0] // side, image.shape[1] // side
    return np.asarray(image.reshape(height, side, width, side, *image.shape[2:]).mean((1, 3)), np.float32)


def strips_of(camera: Camera) -> list[tuple[int, Camera]]:
    """The finer picture in strips: the number of each one's first row, and a camera of its rows alone."""
    fine = finer(camera)
    rows = ROWS_AT_ONCE * SIDE
    tops = range(0, fine.height, rows)
    return [(top, _rows_of(fine, top, min(rows, fine.height - top))) for top in tops]


def _rows_of(camera: Camera, top: int, rows: int) -> Camera:
    """Some rows of a camera's picture as a camera of its own."""
    shifted = camera.K.copy()
    shifted[1] -= top * camera.K[2]
    return Camera(camera.name, shifted, camera.w2c, camera.width, rows)


def lit_hits(asset: Layered, frame: float, cast: Callable[[Camera], Hits]) -> Callable[[Camera], Lit]:
    """A function of cameras (in the frame of the meshes): what they hit of an asset, and what its reflection adds.

    Args:
        frame: of the asset's track, which turns the head in the room's light.
        cast: finds the hits.
    """
    reflection: Any = getattr(asset, "reflection", None)
    maps = None if reflection is None else reflection()
    windows: Any = getattr(asset, "windows", None)

    def found(camera: Camera) -> Lit:
        hits = cast(camera)
        if maps is None:
            return hits, None
        return hits, reflected_colours(hits, camera, windows, maps, room_from(asset, frame))

    return found


def render(asset: Layered, camera: Camera, frame: int, background: ArrayLike = BLACK) -> tuple[Image, Image]:
    """One picture as the format asks for it: means over pixels, with the track and the reflection of the asset.

    Args:
        camera: in the world; an asset with a track stands there as it did in that frame.
        frame: whose textures and pose are shown.
        background: RGB in [0, 1], (3,) or (H, W, 3).

    Returns:
        rgb (H, W, 3) and alpha (H, W), float32 in [0, 1].
    """
    look, textures = lit_hits(asset, frame, AssetCaster(asset, frame).cast), asset.frame(frame)
    parts = []
    for _, strip in strips_of(seen_from(asset, camera, frame)):
        hits, added = look(strip)
        parts.append([pixel_means(one) for one in composite(hits, textures, BLACK, added)])
    rgb, alpha = (np.concatenate(images) for images in zip(*parts, strict=True))
    return rgb + (1 - alpha)[..., None] * np.asarray(background, np.float32), alpha
