"""Directions of reflections, and where they lie in a picture of all directions. numpy arrays or torch tensors."""

from __future__ import annotations

from typing import Any

from facefolds_core.geometry.sphere_uv import library_of


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
