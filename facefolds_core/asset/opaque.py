"""Where layered textures let nothing through: what programs may draw as an opaque surface, with depth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window, texel_uv, uv_to_st

COVERED = 0.95
"""Opacity of a texel and all layers outside it, from which on it counts as opaque.

Of .9, .95, .97, and of single texels above .75, .95 was best or nearly so on the actor and on the tests' caps, whose
colours differ from layer to layer."""
SHOWN = 0.1
"""A texel's own opacity, at least: below, training has hardly seen its colour."""


def opaque_where_covered(textures: Sequence[NDArray[np.uint8]], windows: Sequence[Window]) -> list[NDArray[np.uint8]]:
    """Textures whose alpha is 255 where a layer and those outside it together cover the chart.

    Layers are compared at one place of the chart, the nearest texel of each: straight down, where the least covers.

    Args:
        textures: N x (h, w, 4) RGBA, outermost first.
        windows: of each, on the chart.
    """
    result = []
    for index, (texture, window) in enumerate(zip(textures, windows, strict=True)):
        own = texture[..., 3] / 255.0
        uv, through = texel_uv(own.shape[0], own.shape[1], window), 1 - own
        for other, place in zip(textures[:index], windows[:index], strict=True):
            through *= 1 - _alpha_at(other, uv_to_st(uv, place))
        changed = texture.copy()
        changed[(through <= 1 - COVERED) & (own >= SHOWN), 3] = 255
        result.append(changed)
    return result


def faces_over(mesh: TexturedMesh, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(F,) bool: faces within whose bounding box a bilinear look-up touches a texel of the mask (h, w)."""
    size = mask.shape[::-1]
    area = np.pad(mask.cumsum(0, dtype=np.int64).cumsum(1), ((1, 0), (1, 0)))
    corners = mesh.st[mesh.faces].astype(np.float64) * size - 0.5
    left, top = np.clip(np.floor(corners.min(1)), 0, np.subtract(size, 1)).astype(np.intp).T
    right, bottom = np.clip(np.floor(corners.max(1)) + 2, 1, size).astype(np.intp).T
    return np.asarray(area[bottom, right] - area[top, right] - area[bottom, left] + area[top, left] > 0)


def _alpha_at(texture: NDArray[np.uint8], st: NDArray[np.float64]) -> NDArray[np.float64]:
    """Alpha in [0, 1] of the texels nearest to places (..., 2); 0 outside of the texture."""
    height, width = texture.shape[:2]
    column, row = np.floor(st[..., 0] * width).astype(np.intp), np.floor(st[..., 1] * height).astype(np.intp)
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    alpha = texture[row.clip(0, height - 1), column.clip(0, width - 1), 3] / 255.0
    return np.asarray(np.where(inside, alpha, 0.0))
