"""A warp for tests: thrice the room in a ring than around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.sphere_uv import Window, window_uv
from facefolds_core.geometry.warp import Warp, evened


def ring(window: Window, shape: tuple[int, int] = (65, 81)) -> NDArray[np.float64]:
    """A density (rows, columns) over a window, the same at both ends of v."""
    u, v = np.moveaxis(window_uv(window, *shape), -1, 0)
    u0, u1, v0, v1 = window
    apart = np.hypot((u - 0.5 * (u0 + u1)) / (u1 - u0), (v - 0.5 * (v0 + v1)) / (v1 - v0))
    return np.asarray(1 + 2 * np.exp(-(((apart - 0.3) / 0.1) ** 2)))


def ring_warp(window: Window) -> Warp:
    return evened(ring(window), window)
