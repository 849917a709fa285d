"""The part of the UV map that the training cameras see something on: `sample.window: auto`.

A layer's crossing on a ray contributes its compositing weight w_i = alpha_i prod_{k<i}(1 - alpha_k). Colours lie in
[0, 1], so taking a set S of crossings off a ray, from the back to the front, changes its colour by at most sum_S w_i
(taking one off replaces its colour by that of what lies behind it, and leaves the weights in front of it alone).
Crossings with w_i <= epsilon / N are left out of the window, so a ray loses at most epsilon. That holds for the
rays that were looked at; the margin covers those between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.sphere_uv import Window, closed
from facefolds_core.spacing import spread

if TYPE_CHECKING:
    from facefolds_core.model.radiance import RadianceManifolds

MAX_CHANGE = 1 / 255
"""Largest change of a ray's colour by what the window leaves out: one step of an 8-bit image."""

RAYS_PER_CAMERA = 2500
"""Rays of the lattice laid over each image, at most."""

FRAMES = 3
"""Frames that are looked at, evenly spread."""

MARGIN = 2.0
"""Margin on each side, in steps of the lattice of rays on the surface."""


def visible_window(model: RadianceManifolds, cameras: Sequence[Camera]) -> Window:
    """Bounding window (u0, u1, v0, v1), with a margin, of all that changes a training ray by more than `MAX_CHANGE`.

    Args:
        model: looked at without its view branch, in its first, middle and last frame.
        cameras: the training cameras.

    Returns:
        the window, cut to the model's; the model's if it is transparent everywhere.
    """
    frames = spread(range(model.num_frames), FRAMES)
    low, high, margin = np.full(2, np.inf), np.full(2, -np.inf), 0.0
    for camera in cameras:
        stride = max(1, math.ceil(math.sqrt(camera.width * camera.height / RAYS_PER_CAMERA)))
        seen, step = _seen_uv(model, camera, stride, frames)
        if len(seen):
            low, high = np.minimum(low, seen.min(0)), np.maximum(high, seen.max(0))
            margin = max(margin, MARGIN * step)
    if not np.isfinite(low).all():
        return model.window
    least, most = np.array(model.window).reshape(2, 2).T
    (u0, v0), (u1, v1) = np.maximum(low - margin, least), np.minimum(high + margin, most)
    return closed((float(u0), float(u1), float(v0), float(v1)))


def _seen_uv(
    model: RadianceManifolds, camera: Camera, stride: int, frames: Sequence[int]
) -> tuple[NDArray[np.float64], float]:
    """(u, v) (M, 2) of the crossings that count, and the distance of neighbouring rays on the surface, in (u, v)."""
    uv, weights, hit, points = _crossings(model, camera, stride, frames)
    seen = hit & (weights > MAX_CHANGE / model.num_layers)
    if not seen.any():
        return np.zeros((0, 2)), 0.0
    footprint = stride / min(camera.K[0, 0], camera.K[1, 1])
    distance = np.linalg.norm(points[seen] - camera.centre, axis=-1)
    _, radius = model.chart.uv(points[seen])
    return uv[seen], float(np.median(footprint * distance / radius) * 2 / math.pi)


def _crossings(
    model: RadianceManifolds, camera: Camera, stride: int, frames: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.float64]]:
    """uv [R, N, 2], largest weight over `frames` [R, N], hit [R, N] and points [R, N, 3] on a lattice of rays."""
    x = np.arange(stride // 2, camera.width, stride) + 0.5
    y = np.arange(stride // 2, camera.height, stride) + 0.5
    origins, directions = camera.rays(np.stack(np.meshgrid(x, y), -1).reshape(-1, 2))
    centre = model.centre.detach()
    o, d = torch.as_tensor(np.array(origins)).to(centre), torch.as_tensor(directions).to(centre)
    with torch.no_grad():
        crossings = model.crossings(o, d)
        uv, _ = model.chart.uv(crossings.points)
        weights = torch.stack([model.render(o, d, float(f), view_effects=False).weights for f in frames]).amax(0)
    return (
        uv.double().cpu().numpy(),
        weights.double().cpu().numpy(),
        crossings.hit.cpu().numpy(),
        crossings.points.double().cpu().numpy(),
    )
