"""View effects: what a level adds to its layers' colours, by the way to the eye (docs/reference/asset-format.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.reference import Hits

Map = NDArray[np.float32]
"""(h, w, 3, 3) of one layer: what to add to R, G and B (last axis) for each unit of d_x, d_y and d_z."""


def bilinear(st: NDArray[np.float32], size: tuple[int, int]) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """The four texels (flat indices) and weights of clamped bilinear look-ups in a map of (height, width).

    Args:
        st: (M, 2).

    Returns:
        (M, 4) indices into the flattened map, (M, 4) weights that add up to 1.
    """
    height, width = size
    x = np.clip(st[:, 0] * np.float64(width) - 0.5, 0, width - 1)
    y = np.clip(st[:, 1] * np.float64(height) - 0.5, 0, height - 1)
    left, top = x.astype(np.intp), y.astype(np.intp)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    fx, fy = x - left, y - top
    texels = [top * width + left, top * width + right, bottom * width + left, bottom * width + right]
    weights = [(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx]
    return np.stack(texels, -1), np.stack(weights, -1).astype(np.float32)


def to_eye(camera: Camera) -> NDArray[np.float32]:
    """(H, W, 3) unit vectors from what each pixel shows to the eye."""
    _, directions = camera.rays()
    return np.asarray(-directions, np.float32)


def added_colours(hits: Hits, eye: NDArray[np.float32], maps: Sequence[Map]) -> list[NDArray[np.float32]]:
    """What `composite` adds to each layer's colours; the same for all frames.

    Args:
        hits: of one camera.
        eye: (H, W, 3), `to_eye` of the camera.
        maps: one a layer.

    Returns:
        for each layer (M, 3), in the order of its hits.
    """
    added = []
    for i, table in enumerate(maps):
        hit = hits.hit[..., i]
        texels, weights = bilinear(hits.st[..., i, :][hit], (table.shape[0], table.shape[1]))
        found = np.einsum("mt,mtkc->mkc", weights, table.reshape(-1, 3, 3)[texels])
        added.append(np.asarray(np.einsum("mk,mkc->mc", eye[hit], found), np.float32))
    return added
