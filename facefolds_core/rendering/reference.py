"""The reference renderer: an asset as it ships, seen from a camera. Slow and clear: faster players are held against it.

What it does is what docs/reference/asset-format.md asks of a player:
- one ray through each pixel's centre, no anti-aliasing; the nearest hit with each layer counts, whichever side it is;
- (s, t) from the triangle's vertices; RGBA by bilinear interpolation of the stored (sRGB-encoded) values, colour and
  straight alpha each by itself, clamped to the texture's edge texels;
- layers put together outermost first, whatever their distance along the ray, in stored values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh, layers_at
from facefolds_core.geometry.rays import MISS, EmbreeMesh
from facefolds_core.geometry.track import Track

Image = NDArray[np.float32]
Texture = NDArray[np.uint8]
"""(h, w, 4) RGBA, straight alpha; sizes may differ between layers."""

BLACK = (0.0, 0.0, 0.0)


class Layered(Protocol):
    """What the renderer needs of an asset: its meshes, outermost first, and frame k of its textures."""

    @property
    def layers(self) -> Sequence[TexturedMesh]: ...
    def frame(self, k: int, /) -> Sequence[Texture]:
        """N textures, straight alpha."""
        ...


@dataclass(frozen=True)
class Hits:
    """Nearest hit of each pixel's ray with each of N layers, outermost first. It serves all frames: meshes stand still.

    Attributes:
        hit: (H, W, N) bool; of chosen rays (1, M, N).
        st: (H, W, N, 2) float32 texture coordinates; 0 where nothing is hit.
    """

    hit: NDArray[np.bool_]
    st: NDArray[np.float32]

    def choose(self, rng: np.random.Generator, most: int) -> NDArray[np.intp]:
        """Numbers, rising, of at most so many pixels whose rays hit anything."""
        seen = np.flatnonzero(self.hit.any(2))
        return np.sort(rng.choice(seen, min(most, len(seen)), replace=False))

    def at(self, pixels: NDArray[np.intp]) -> Hits:
        """(1, M, N): of these pixels, by number."""
        count = self.hit.shape[2]
        return Hits(self.hit.reshape(-1, count)[None, pixels], self.st.reshape(-1, count, 2)[None, pixels])

    @classmethod
    def joined(cls, parts: Sequence[Hits]) -> Hits:
        """(1, M, N) of all parts (1, ..., N), one after the other."""
        return cls(np.concatenate([part.hit for part in parts], 1), np.concatenate([part.st for part in parts], 1))


def track_of(asset: Layered) -> Track | None:
    """The motion of an asset that has a `track`."""
    track: Track | None = getattr(asset, "track", None)
    return track


def layers_in(asset: Layered, frame: float) -> Sequence[TexturedMesh]:
    """The layers of an asset in a frame, in their own axes."""
    return layers_at(asset.layers, track_of(asset), frame)


class AssetCaster:
    """Casts rays at the meshes of an asset as they are in a frame, or as they were made; one Embree scene a layer."""

    def __init__(self, asset: Layered, frame: float | None = None) -> None:
        layers = asset.layers if frame is None else layers_in(asset, frame)
        self._layers = [(EmbreeMesh(layer.vertices, layer.faces), layer.st[layer.faces]) for layer in layers]

    def cast(self, camera: Camera) -> Hits:
        """Hits of the rays through all pixel centres of `camera`."""
        origins, directions = (np.reshape(rays, (-1, 3)) for rays in camera.rays())
        count = (len(origins), len(self._layers))
        hit, st = np.zeros(count, bool), np.zeros((*count, 2), np.float32)
        for i, (mesh, corners) in enumerate(self._layers):
            found = mesh.nearest(origins, directions)
            rays = np.flatnonzero(found.triangle != MISS)
            hit[rays, i] = True
            weights = found.barycentric[rays]
            st[rays, i] = np.einsum("rk,rkc->rc", weights, corners[found.triangle[rays]].astype(np.float64))
        image = (camera.height, camera.width, len(self._layers))
        return Hits(hit.reshape(image), st.reshape(*image, 2))


def texels_around(st: NDArray[np.float32], width: int, height: int) -> tuple[NDArray[Any], ...]:
    """Of places (M, 2): left, right, top and bottom of the four texels around, clamped; the shares of right and bottom.

    Texel (row i, column j) has its centre at s = (j + 0.5) / width, t = (i + 0.5) / height.
    """
    x = np.clip(st[:, 0] * np.float64(width) - 0.5, 0, width - 1)
    y = np.clip(st[:, 1] * np.float64(height) - 0.5, 0, height - 1)
    left, top = x.astype(np.intp), y.astype(np.intp)
    return left, np.minimum(left + 1, width - 1), top, np.minimum(top + 1, height - 1), x - left, y - top


def sample_texture(texture: Texture, st: NDArray[np.float32]) -> Image:
    """Bilinear look-up, clamped to the edge texels' centres.

    Args:
        texture: (H, W, C) uint8.
        st: (M, 2), s right and t down.

    Returns:
        (M, C) float32 in [0, 1].
    """
    left, right, top, bottom, *shares = texels_around(st, texture.shape[1], texture.shape[0])
    fx, fy = (share.astype(np.float32)[:, None] for share in shares)
    upper = (1 - fx) * texture[top, left] + fx * texture[top, right]
    lower = (1 - fx) * texture[bottom, left] + fx * texture[bottom, right]
    return np.asarray(((1 - fy) * upper + fy * lower) / np.float32(255), np.float32)


def composite(
    hits: Hits,
    textures: Sequence[Texture],
    background: ArrayLike = BLACK,
    added: Sequence[Image] | None = None,
) -> tuple[Image, Image]:
    """C = sum_i alpha_i c_i prod_{k<i} (1 - alpha_k) + transmittance * background, in stored values.

    Args:
        hits: of one camera.
        textures: N textures (h, w, 4) uint8, one frame of all layers.
        background: RGB in [0, 1], (3,) or (H, W, 3).
        added: for each layer (M, 3), what to add to the colours of its M hits before blending: the reflection.

    Returns:
        rgb (H, W, 3) and alpha (H, W), float32 in [0, 1].
    """
    if len(textures) != hits.hit.shape[2]:
        raise ValueError(f"{len(textures)} textures for {hits.hit.shape[2]} layers")
    rgb = np.zeros((*hits.hit.shape[:2], 3), np.float32)
    light = np.ones(hits.hit.shape[:2], np.float32)  # prod (1 - alpha_k) of the layers so far
    for i, texture in enumerate(textures):
        hit = hits.hit[..., i]
        rgba = sample_texture(texture, hits.st[..., i, :][hit])
        colour = rgba[:, :3] if added is None else np.clip(rgba[:, :3] + added[i], 0, 1)
        before, alpha = light[hit], rgba[:, 3]
        light[hit] = before * (1 - alpha)
        rgb[hit] += (before * alpha)[:, None] * colour
    rgb += light[..., None] * np.asarray(background, np.float32)
    return rgb, 1 - light


def opacity(hits: Hits, textures: Sequence[Texture]) -> Image:
    """Alpha alone, as `composite` has it: (H, W) float32 in [0, 1]."""
    light = np.ones(hits.hit.shape[:2], np.float32)
    for i, texture in zip(range(hits.hit.shape[2]), textures, strict=True):
        hit = hits.hit[..., i]
        light[hit] *= 1 - sample_texture(texture[..., 3:], hits.st[..., i, :][hit])[:, 0]
    return np.asarray(1 - light, np.float32)


def seen_from(asset: Layered, camera: Camera, frame: float) -> Camera:
    """A camera of the world in the frame of the meshes, which an asset with a `track` moves."""
    track = track_of(asset)
    return camera if track is None else track.camera(camera, frame)


def room_from(asset: Layered, frame: float) -> NDArray[np.float64]:
    """(3, 3) rotation from the meshes' axes in a frame to those of the room, which the reflected light is fixed to."""
    track = track_of(asset)
    return np.eye(3) if track is None else track.at(frame).rotation
