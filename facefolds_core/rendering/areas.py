"""Pictures as a camera takes them: each pixel the mean of its area, by SIDE x SIDE rays. Compiled; slow and plain is
`pixels.render`, which tests hold this against.

A photo's pixel is the mean of what falls on its square. One ray through the pixel's centre is not: the true surface of
`mugsy` drawn so scores 36 and 33 dB against the photos, by 16 rays 44 and 42.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import ArrayLike, NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.kernels.jit import compiled, kernel
from facefolds_core.rendering.pixels import SIDE, Image, Lit, finer, lit_hits, pixel_means, strips_of
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import BLACK, Hits, Layered, layers_in, seen_from


@dataclass(frozen=True)
class LayerHits:
    """Where rays meet one layer.

    Attributes:
        rays: (M,) their numbers, row-major in the finer picture.
        st: (M, 2) float32 texture coordinates.
        added: (M, 3) float32 what a reflection adds to the colours; (0, 3) for nothing.
    """

    rays: NDArray[np.int32]
    st: Image
    added: Image


NOTHING = np.zeros((0, 3), np.float32)


class AreaView:
    """What one camera sees of N layers. It serves all frames in which camera and layers stand still.

    Args:
        size: (H, W) of the picture.
        layers: of each layer its hits, outermost first, with the rays of `finer`.
    """

    def __init__(self, size: tuple[int, int], layers: Sequence[LayerHits]) -> None:
        self.size, self.layers = size, layers

    @classmethod
    def of_hits(cls, camera: Camera, hits: Callable[[Camera], Lit]) -> AreaView:
        """Of a camera, and a function of cameras that finds hits and what is added to each layer's colours there."""
        width = finer(camera).width
        parts: list[list[LayerHits]] = []
        for top, strip in strips_of(camera):
            found, added = hits(strip)
            parts.append(
                [
                    _layer(found, i, NOTHING if added is None else added[i], top * width)
                    for i in range(found.hit.shape[2])
                ]
            )
        layers = [
            LayerHits(*(np.concatenate([getattr(part, name) for part in of]) for name in ("rays", "st", "added")))
            for of in zip(*parts, strict=True)
        ]
        return cls((camera.height, camera.width), layers)

    def composite(
        self, textures: Sequence[NDArray[Any]], background: ArrayLike = BLACK, lit: bool = True
    ) -> tuple[Image, Image]:
        """As `reference.composite`, over areas.

        Args:
            textures: N textures (h, w, 4), uint8 or float32 in [0, 1].
            background: RGB in [0, 1], (3,) or (H, W, 3).
            lit: with what a reflection adds.

        Returns:
            rgb (H, W, 3) and alpha (H, W), float32 in [0, 1].
        """
        if len(textures) != len(self.layers):
            raise ValueError(f"{len(textures)} textures for {len(self.layers)} layers")
        height, width = (SIDE * n for n in self.size)
        light, rgb = np.ones(height * width, np.float32), np.zeros((height * width, 3), np.float32)
        for texture, layer in zip(textures, self.layers, strict=True):
            scale = np.float32(1 / 255 if texture.dtype == np.uint8 else 1)
            added = layer.added if lit else NOTHING
            _blend(np.ascontiguousarray(texture), scale, layer.rays, layer.st, added, light, rgb)
        through = pixel_means(light.reshape(height, width))
        seen = pixel_means(rgb.reshape(height, width, 3))
        return seen + through[..., None] * np.asarray(background, np.float32), 1 - through


def view_of(asset: Layered, camera: Camera, frame: float = 0) -> AreaView:
    """What a camera of the world sees of an asset's full level in `frame`, with its track and its reflection."""
    layers = layers_in(asset, frame)
    hits = lit_hits(asset, frame, lambda part: cast_layers(part, layers))
    return AreaView.of_hits(seen_from(asset, camera, frame), hits)


def _layer(hits: Hits, layer: int, added: Image, first: int) -> LayerHits:
    hit = hits.hit[..., layer]
    return LayerHits((first + np.flatnonzero(hit)).astype(np.int32), hits.st[..., layer, :][hit], added)


@kernel(parallel=True)
def _blend(  # type: ignore[no-untyped-def]
    texture,  # (h, w, 4)
    scale,  # of its values, to [0, 1]
    rays,  # (M,) int32, none twice
    st,  # (M, 2) float32
    added,  # (M, 3) float32, or (0, 3)
    light,  # (P,) float32 transmittance before this layer; after it afterwards
    rgb,  # (P, 3) float32, added to
):
    one, zero = np.float32(1.0), np.float32(0.0)
    for m in prange(rays.shape[0]):
        i, i1, a = _between(st[m, 1], texture.shape[0])
        j, j1, b = _between(st[m, 0], texture.shape[1])
        w00, w01, w10, w11 = (one - a) * (one - b), (one - a) * b, a * (one - b), a * b
        opacity = w00 * texture[i, j, 3] + w01 * texture[i, j1, 3] + w10 * texture[i1, j, 3] + w11 * texture[i1, j1, 3]
        ray = rays[m]
        before = light[ray]
        weight = before * opacity * scale
        for q in range(3):
            value = (
                w00 * texture[i, j, q] + w01 * texture[i, j1, q] + w10 * texture[i1, j, q] + w11 * texture[i1, j1, q]
            )
            value *= scale
            if added.shape[0] > 0:
                value = min(max(value + added[m, q], zero), one)
            rgb[ray, q] += weight * value
        light[ray] = before - weight


@compiled
def _between(at: Any, count: Any) -> Any:
    """The two of `count` texels around a texture coordinate, and the share of the second; clamped at the edge."""
    place = min(max(at * np.float64(count) - 0.5, 0.0), count - 1.0)
    first = int(place)
    return first, min(first + 1, count - 1), np.float32(place - first)
