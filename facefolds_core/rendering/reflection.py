"""A reflection: what a level adds to its layers' colours, by the direction (docs/reference/asset-format.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.reflections import ReflectionMaps, reflected, sphere_position
from facefolds_core.geometry.sphere_uv import Window, st_to_uv, uv_to_st
from facefolds_core.rendering.reference import Hits, texels_around

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
    left, right, top, bottom, fx, fy = texels_around(np.asarray(st, np.float32), table.shape[1], table.shape[0])
    texels = np.stack([table[top, left], table[top, right], table[bottom, left], table[bottom, right]], 1)
    weights = np.stack([(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx], -1).astype(np.float32)
    return np.asarray(np.einsum("mt,mtc->mc", weights, texels), np.float32)
