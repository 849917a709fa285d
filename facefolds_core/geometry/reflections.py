"""Directions of reflections, and where they lie in a picture of all directions. numpy arrays or torch tensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.sphere_uv import Window, library_of


def reflected(directions: Any, normals: Any) -> Any:
    """r = d - 2 min(d . n, 0) n of unit directions of rays and unit normals (..., 3): a normal that points away from
    the eye lets the direction go on, so that nothing jumps where a surface turns away."""
    lib = library_of(directions)
    along = (directions * normals).sum(-1)[..., None]
    return directions - 2 * lib.clip(along, None, 0) * normals


def sphere_position(directions: Any) -> Any:
    """Unit directions (..., 3) -> (s, t) (..., 2) in a picture of all directions: the equal-area projection with the
    subject's front (+x) in the middle and its back (-x) on the circle around it; s right with +y, t down with -z."""
    lib = library_of(directions)
    scale = 0.5 / lib.sqrt(lib.clip(2 * (1 + directions[..., 0]), 1e-6, None))
    return lib.stack([0.5 + scale * directions[..., 1], 0.5 - scale * directions[..., 2]], -1)


@dataclass(frozen=True)
class ReflectionMaps:
    """A reflection as it is shown: `model.reflection` says what the maps mean. float32.

    Attributes:
        window: (u0, u1, v0, v1) that gloss, offset and normals cover.
        gloss: (h, w), not negative.
        offset: (h, w, 3).
        normals: (h, w, 3), about unit length.
        environment: (e, e, 3), not negative.
    """

    window: Window
    gloss: NDArray[np.float32]
    offset: NDArray[np.float32]
    normals: NDArray[np.float32]
    environment: NDArray[np.float32]


def window_to_window(given: Window, wanted: Window) -> tuple[float, float, float, float]:
    """(a, b, c, d): (s, t) over `given` is (a s + c, b t + d) over `wanted`."""
    u0, u1, v0, v1 = given
    wu0, wu1, wv0, wv1 = wanted
    height, width = wu1 - wu0, wv1 - wv0
    return (v1 - v0) / width, (u1 - u0) / height, (v0 - wv0) / width, (wu1 - u1) / height
