"""What of each layer holds anything: the part of its texture that ships, and the triangles that show it.

A texel holds something if its alpha exceeds ALPHA_BOUND in any frame. A triangle stays if any texel that bilinear
look-ups within its bounding box touch holds something, or if such a triangle lies behind it: the nearest hit of a layer
counts, so through a hole in the front of a head the back of that layer would be drawn over all others. A layer without
triangles that hold anything is left out. What goes has alpha <= 1/255 everywhere and in all frames: of one layer, it
changes no pixel by more than 1/255 (colours lie in [0, 1]). The texture is cropped to what the remaining triangles look
up, so that no look-up changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.opaque import faces_over
from facefolds_core.asset.packing import Rect
from facefolds_core.errors import UserError
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.rays import MISS, EmbreeMesh
from facefolds_core.geometry.sphere_uv import Window

ALPHA_BOUND = 1
"""Of 255: alpha up to it counts as nothing."""
DIRECTIONS = 128
"""Spread over the sphere, about 18 degrees apart: along those that enter a triangle from outside it is asked what lies
behind it."""


class TextureFrames(Protocol):
    """Layered textures (a FrameStore): RGBA, straight alpha, R x R each."""

    def image(self, camera: int, frame: int, /) -> NDArray[np.uint8]:
        """(R, R, 4) of one layer and frame."""
        ...


@dataclass(frozen=True)
class CroppedLayer:
    """A layer as it ships.

    Attributes:
        source: its index among the layers that were given.
        mesh: triangles that show something; st local to the crop.
        window: (u0, u1, v0, v1) of the crop.
        crop: (x, y, width, height) of the crop in the layer's own texture, texels.
    """

    source: int
    mesh: TexturedMesh
    window: Window
    crop: Rect

    def cut(self, texture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The crop of a texture (R, R, 4): (height, width, 4)."""
        x, y, width, height = self.crop
        return texture[y : y + height, x : x + width]


def crop_layers(
    meshes: Sequence[TexturedMesh], windows: Sequence[Window], textures: TextureFrames, frames: int, unit: int = 1
) -> tuple[CroppedLayer, ...]:
    """The layers that show anything, outermost first.

    Args:
        unit: a divisor of R, of which the crops' numbers are multiples.

    Raises:
        UserError: if none does.
    """
    cropped = []
    for layer, (mesh, window) in enumerate(zip(meshes, windows, strict=True)):
        alpha = textures.image(layer, 0)[..., 3]
        for frame in range(1, frames):
            alpha = np.maximum(alpha, textures.image(layer, frame)[..., 3])
        shown = faces_over(mesh, alpha > ALPHA_BOUND)
        if shown.any():
            kept = shown | _covering(mesh, shown)
            cropped.append(_crop(layer, mesh, mesh.faces[kept], window, len(alpha), unit))
    if not cropped:
        raise UserError(
            "every layer is transparent",
            expected=f"a texel with alpha above {ALPHA_BOUND}/255",
            remedy="train longer, or with another preset: the model shows nothing",
        )
    return tuple(cropped)


def _covering(mesh: TexturedMesh, shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(F,) bool: faces that are not shown and through which somebody outside would see one that is."""
    found, clear = np.zeros(len(shown), bool), np.flatnonzero(~shown)
    corners = mesh.vertices[mesh.faces[clear]].astype(np.float64)
    middles, normals = corners.mean(1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    behind = EmbreeMesh(mesh.vertices, mesh.faces[shown])
    for direction in _directions():
        asked = np.flatnonzero(~found[clear] & (normals @ direction < 0))
        hit = behind.first(middles[asked], np.tile(direction, (len(asked), 1))) != MISS
        found[clear[asked[hit]]] = True
    return found


def _directions() -> NDArray[np.float64]:
    """(DIRECTIONS, 3) unit vectors, evenly over the sphere: a spiral that turns by the golden angle."""
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(DIRECTIONS)
    height = 1 - 2 * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], -1)


def _crop(
    layer: int, mesh: TexturedMesh, faces: NDArray[np.int32], window: Window, size: int, unit: int
) -> CroppedLayer:
    used, compact = np.unique(faces, return_inverse=True)
    st = mesh.st[used].astype(np.float64) * size
    left, top = np.clip(np.floor(st.min(0) - 0.5), 0, size - 1).astype(int).tolist()
    right, bottom = np.clip(np.ceil(st.max(0) + 0.5), 1, size).astype(int).tolist()
    left, top = left // unit * unit, top // unit * unit
    right, bottom = -(-right // unit) * unit, -(-bottom // unit) * unit
    width, height = right - left, bottom - top
    local = np.clip((st - (left, top)) / (width, height), 0, 1).astype(np.float32)
    u0, u1, v0, v1 = window
    du, dv = (u1 - u0) / size, (v1 - v0) / size
    return CroppedLayer(
        source=layer,
        mesh=TexturedMesh(mesh.vertices[used], compact.reshape(faces.shape).astype(np.int32), local),
        window=(u1 - bottom * du, u1 - top * du, v0 + left * dv, v0 + right * dv),
        crop=(left, top, width, height),
    )
