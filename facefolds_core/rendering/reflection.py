"""A reflection: what a level adds to its layers' colours, by the direction (docs/reference/asset-format.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.reflections import ReflectionMaps, reflected, sphere_position
from facefolds_core.geometry.sphere_uv import Window, st_to_uv, uv_to_st
from facefolds_core.rendering.reference import Hits

Array = NDArray[np.float32]


def reflected_colours(
    hits: Hits,
    camera: Camera,
    windows: Sequence[Window],
    maps: ReflectionMaps,
    to_room: NDArray[np.float64] | None = None,
) -> list[Array]:
    """What `composite` adds to each layer's colours; the same for all frames.

    Args:
        hits: of `camera`.
        windows: of each layer's texture coordinates.
        to_room: (3, 3) rotation from the asset's axes to those of the room that the environment is fixed to; None for
            none. The one place where a head that moves is turned back.

    Returns:
        for each layer (M, 3), in the order of its hits.
    """
    directions = np.reshape(camera.rays()[1], (*hits.hit.shape[:2], 3))
    added = []
    for i, window in enumerate(windows):
        hit = hits.hit[..., i]
        st = uv_to_st(st_to_uv(hits.st[..., i, :][hit].astype(np.float64), window), maps.window)
        normals = look_up(maps.normals, st).astype(np.float64)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        r = reflected(directions[hit], normals)
        light = look_up(maps.environment, sphere_position(r if to_room is None else r @ to_room.T))
        added.append(look_up(maps.gloss[..., None], st) * light - look_up(maps.offset, st))
    return added


def look_up(table: Array, st: NDArray[np.float64]) -> Array:
    """(h, w, C) at (M, 2), bilinear, clamped -> (M, C)."""
    texels, weights = bilinear(np.asarray(st, np.float32), (table.shape[0], table.shape[1]))
    return np.asarray(np.einsum("mt,mtc->mc", weights, table.reshape(-1, table.shape[-1])[texels]), np.float32)


def bilinear(st: Array, size: tuple[int, int]) -> tuple[NDArray[np.intp], Array]:
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
