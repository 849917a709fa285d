"""The paper's map f between directions around the sphere centre c and texture coordinates.

With n = (p - c) / |p - c|: u = 2/pi asin(n_z), v = 2/pi atan2(n_y, n_x) (paper, "Model Architecture and Training").
u is elevation / 90 degrees, v is azimuth / 90 degrees. The texture is the hemisphere n_x > 0, u and v in [-1, 1].

A texture image of H x W texels over a window (u0, u1, v0, v1) has row 0 at the top of the head (u near u1) and columns
that grow with v, that is to the right as seen from the front: texel (row i, column j) has its centre at
u = u1 - (i + 0.5) (u1 - u0) / H,  v = v0 + (j + 0.5) (v1 - v0) / W.
In normalised texture coordinates (s right, t down, both in [0, 1] over the image): s = (v - v0) / (v1 - v0),
t = (u1 - u) / (u1 - u0).

All functions take numpy arrays or torch tensors and return the same kind.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

Window = tuple[float, float, float, float]
FULL_WINDOW: Window = (-1.0, 1.0, -1.0, 1.0)
"""(u0, u1, v0, v1) of the whole hemisphere."""


def library_of(x: Any) -> Any:
    """torch for its tensors, numpy for all else. Nobody has a tensor who has not imported torch: readers need none."""
    torch = sys.modules.get("torch")
    return torch if torch is not None and isinstance(x, torch.Tensor) else np


def directions_to_uv(directions: Any) -> Any:
    """Unit directions (..., 3) -> (u, v) (..., 2). v goes beyond [-1, 1] where n_x < 0."""
    lib = library_of(directions)
    # asin has an infinite slope at +-1; clipping a hair inside keeps the gradient finite at the poles.
    z = lib.clip(directions[..., 2], -1 + 1e-7, 1 - 1e-7)
    u = lib.arcsin(z) * (2 / math.pi)
    v = lib.arctan2(directions[..., 1], directions[..., 0]) * (2 / math.pi)
    return lib.stack([u, v], -1)


def uv_to_directions(uv: Any) -> Any:
    """(u, v) (..., 2) -> unit directions (..., 3). The inverse of `directions_to_uv`."""
    lib = library_of(uv)
    elevation = uv[..., 0] * (math.pi / 2)
    azimuth = uv[..., 1] * (math.pi / 2)
    flat = lib.cos(elevation)
    return lib.stack([flat * lib.cos(azimuth), flat * lib.sin(azimuth), lib.sin(elevation)], -1)


def points_to_uv(points: Any, centre: Any) -> tuple[Any, Any]:
    """Points (..., 3) and the centre (3,) -> (u, v) (..., 2) and the radius |p - c| (...)."""
    lib = library_of(points)
    offset = points - centre
    radius = lib.sqrt((offset**2).sum(-1))
    safe = lib.clip(radius, 1e-12, None)
    return directions_to_uv(offset / safe[..., None]), radius


ALL_AROUND = 4.0
"""v of a window that goes all around: 360 degrees."""
GAP = 0.15
"""A window that lacks less of it, 13 degrees, goes all around."""


def closed(window: Window) -> Window:
    """A window with a narrow gap behind made to go all around; others as they are."""
    u0, u1, v0, v1 = window
    return (u0, u1, -ALL_AROUND / 2, ALL_AROUND / 2) if v1 - v0 >= ALL_AROUND - GAP else window


def uv_to_st(uv: Any, window: Window = FULL_WINDOW) -> Any:
    """(u, v) (..., 2) -> (s, t) (..., 2): s right, t down, [0, 1] over the window's image."""
    lib = library_of(uv)
    u0, u1, v0, v1 = window
    return lib.stack([(uv[..., 1] - v0) / (v1 - v0), (u1 - uv[..., 0]) / (u1 - u0)], -1)


def st_to_uv(st: Any, window: Window = FULL_WINDOW) -> Any:
    """(s, t) (..., 2) -> (u, v) (..., 2). The inverse of `uv_to_st`."""
    lib = library_of(st)
    u0, u1, v0, v1 = window
    return lib.stack([u1 - st[..., 1] * (u1 - u0), v0 + st[..., 0] * (v1 - v0)], -1)


def texel_uv(height: int, width: int, window: Window = FULL_WINDOW) -> np.ndarray:
    """(height, width, 2) float64: (u, v) at the texel centres of an image over `window`."""
    s, t = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.asarray(st_to_uv(np.stack([s, t], -1), window))


def row_strides(resolution: int, window: Window, lowest: float = -math.inf) -> NDArray[np.intp]:
    """(R,) how many columns of each row span the same angle as one column does at the equator: 1 / cos(elevation).

    Args:
        lowest: no row's u counts as less: below a chart's belt elevations stay as they are.
    """
    u = np.maximum(texel_uv(resolution, resolution, window)[:, 0, 0], lowest)
    strides = np.rint(1 / np.maximum(np.cos(u * np.pi / 2), 1e-9))
    return np.asarray(np.clip(strides, 1, resolution), np.intp)
