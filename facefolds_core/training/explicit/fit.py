"""What the explicit model takes from the scene: window, starting radii, texels. Each by a rule stated here."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.captures.scene import SPHERE_CENTRE, Scene
from facefolds_core.geometry.sphere_uv import Window, directions_to_uv, uv_to_directions
from facefolds_core.training.start import fitted_radius

Array = NDArray[np.float64]

WINDOW_MARGIN = 0.35
"""The window reaches this fraction of the mesh's extent beyond the mesh on each side: room for hair and ears."""

WINDOW_LIMIT = 0.9
"""No window reaches beyond |u|, |v| = 0.9: at the poles and behind c a radius map has no meaning."""

NODES = 384
"""Nodes along the longer side of the radius maps."""

PIXELS_PER_TEXEL = 2.0
"""Of the finest textures, seen head on from the median camera. One pixel a texel measured 0.2 to 0.4 dB worse on
cameras left out: some thirty cameras do not determine so many texels of twelve layers."""

MESH_TRUST = 0.004
"""Where the opacity found is nearer to the tracked mesh than this, the mesh is kept; farther offsets lose as
much, units."""

MESH_HALFWIDTH = 0.025
"""Half of the space between the outermost and the innermost layer in the first round around a tracked mesh, units: a
mesh knows no hair."""

SPHERE_HALFWIDTH = 0.12
"""The same where there is no mesh."""


@dataclass(frozen=True)
class Fit:
    """What was chosen, and why.

    Attributes:
        window: (u0, u1, v0, v1).
        middle: (rows, columns) starting radii of the middle of the layers, units.
        trust: offsets of the layers from the start are shrunk by this much towards 0, units.
        halfwidths: half the space between outermost and innermost layer, one for each round of geometry, units; the
            last one is the model's.
        texels: (H, W) of the finest textures.
        reasons: one line a choice.
    """

    window: Window
    middle: Array
    trust: float
    halfwidths: tuple[float, ...]
    texels: tuple[int, int]
    reasons: tuple[str, ...]


def fit_scene(scene: Scene, halfwidth: float) -> Fit:
    """Start from the tracked mesh where there is one, else from a sphere and the cameras."""
    surface = scene.load_surface()
    cameras = [scene.cameras[i] for i in scene.indices("train")]
    if surface is not None:
        vertices, faces = surface
        window = mesh_window(vertices.astype(np.float64))
        rows, columns = _nodes(window)
        middle = extrapolate(mesh_radii(vertices.astype(np.float64), faces, window, rows, columns))
        widest, trust = MESH_HALFWIDTH, MESH_TRUST
        reasons = [
            f"window: the tracked mesh over all frames, {WINDOW_MARGIN:.0%} of its extent added on each side",
            "middle radius: the tracked mesh, mean over frames, continued smoothly beyond its border",
        ]
    else:
        r0, farthest = fitted_radius(cameras)
        window = ball_window(farthest - float(np.linalg.norm(SPHERE_CENTRE)))
        rows, columns = _nodes(window)
        middle = np.full((rows, columns), r0)
        widest, trust = SPHERE_HALFWIDTH, 0.0
        reasons = [
            "window: a ball at the scene's origin that fills 0.8 of the median camera's narrower half field of view",
            f"middle radius: a sphere of {r0:.3f}",
        ]
    halfwidths = shrinking(widest, halfwidth)
    reasons.append(f"then {len(halfwidths) - 1} rounds: each moves the layers to the opacity found and narrows them")
    texels = texel_count(scene, window, float(np.median(middle)))
    reasons.append(f"texels: {PIXELS_PER_TEXEL:g} pixels each, seen head on from the median training camera")
    return Fit(window, middle, trust, halfwidths, texels, tuple(reasons))


def shrinking(widest: float, narrowest: float) -> tuple[float, ...]:
    """From `widest` to `narrowest` (first and last value) by equal factors of at most 2."""
    rounds = max(0, math.ceil(math.log2(widest / narrowest) - 1e-9))
    return (*(widest * (narrowest / widest) ** (k / rounds) for k in range(rounds)), narrowest)


def mesh_window(vertices: Array) -> Window:
    """Vertices (K, V, 3) -> the box around the (u, v) of those in front of c, widened by WINDOW_MARGIN."""
    offset = vertices.reshape(-1, 3) - np.array(SPHERE_CENTRE)
    offset = offset[offset[:, 0] > 0]
    uv = directions_to_uv(offset / np.linalg.norm(offset, axis=1, keepdims=True))
    low, high = uv.min(0), uv.max(0)
    margin = WINDOW_MARGIN * (high - low)
    low, high = np.maximum(low - margin, -WINDOW_LIMIT), np.minimum(high + margin, WINDOW_LIMIT)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def ball_window(radius: float) -> Window:
    """The directions from c under which a ball of `radius` at the origin is seen, at most WINDOW_LIMIT."""
    sine = min(1.0, radius / float(np.linalg.norm(SPHERE_CENTRE)))
    reach = min(WINDOW_LIMIT, 1.1 * 2 / math.pi * math.asin(sine))
    return -reach, reach, -reach, reach


def _nodes(window: Window) -> tuple[int, int]:
    height, width = window[1] - window[0], window[3] - window[2]
    scale = NODES / max(height, width)
    return max(8, round(scale * height)), max(8, round(scale * width))


def mesh_radii(vertices: Array, faces: NDArray[np.int32], window: Window, rows: int, columns: int) -> Array:
    """(rows, columns) distance of the mesh's outermost point from c at the grid's nodes, mean over frames (K, V, 3).

    NaN where no frame's mesh has a point.
    """
    u, v = np.linspace(window[1], window[0], rows), np.linspace(window[2], window[3], columns)
    directions = uv_to_directions(np.stack(np.meshgrid(u, v, indexing="ij"), -1).reshape(-1, 2))
    centre = np.array(SPHERE_CENTRE)
    total, count = np.zeros(len(directions)), np.zeros(len(directions))
    for frame in vertices[:: max(1, len(vertices) // 12)]:
        mesh = trimesh.Trimesh(frame, faces, process=False)
        start = 2 * float(np.linalg.norm(frame - centre, axis=1).max())
        points, ray, _ = mesh.ray.intersects_location(centre + start * directions, -directions, multiple_hits=False)
        total[ray] += np.linalg.norm(points - centre, axis=1)
        count[ray] += 1
    radii = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return radii.reshape(rows, columns)


def extrapolate(radii: Array) -> Array:
    """Fill NaN: the nearest known value, relaxed from coarse to fine with the known ones held."""
    missing = np.isnan(radii)
    if not missing.any():
        return radii
    nearest = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    filled: Array = radii[tuple(nearest)]
    for sigma in (32, 16, 8, 4, 2, 1):
        for _ in range(8):
            filled = np.where(missing, ndimage.gaussian_filter(filled, sigma, mode="nearest"), radii)
    return filled


def texel_count(scene: Scene, window: Window, radius: float) -> tuple[int, int]:
    """(H, W), multiples of 16: a texel at `radius` from c is PIXELS_PER_TEXEL pixels of the median training camera."""
    cameras = [scene.cameras[i] for i in scene.indices("train")]
    pixel = float(np.median([np.linalg.norm(c.centre) / c.K[0, 0] for c in cameras]))
    texel = PIXELS_PER_TEXEL * pixel
    height = (window[1] - window[0]) * math.pi / 2 * radius / texel
    width = (window[3] - window[2]) * math.pi / 2 * radius / texel
    return max(32, 16 * round(height / 16)), max(32, 16 * round(width / 16))


def recentre(radii: Array, alpha: NDArray[np.float32], blur: float) -> Array:
    """How far the layers should move to lie around the opacity found, along the directions from outside to c.

    With w_i = alpha_i prod_{k<i} (1 - alpha_k), the offset of a node is sum_i w_i (rho_i - middle) / sum_i w_i. It is
    smoothed with sum_i w_i as the weight, so that transparent directions follow their neighbours and detail of the
    start finer than `blur` is kept.

    Args:
        radii: (rows, columns, N).
        alpha: (rows, columns, N) opacity at the same nodes.
        blur: standard deviation of the smoothing, nodes.

    Returns:
        (rows, columns) to be added to the middle radius, units.
    """
    before = np.cumprod(np.concatenate([np.ones_like(alpha[..., :1]), 1 - alpha[..., :-1]], -1), -1)
    weights = (alpha * before).astype(np.float64)
    mass = weights.sum(-1)
    middle = 0.5 * (radii[..., 0] + radii[..., -1])
    moment = (weights * (radii - middle[..., None])).sum(-1)
    moved = np.zeros_like(middle)
    # From coarse to fine: where a scale holds less opacity than a tenth of a layer, the coarser one decides.
    for scale in (16.0, 4.0, 1.0):
        near = ndimage.gaussian_filter(mass, scale * blur, mode="nearest")
        found = ndimage.gaussian_filter(moment, scale * blur, mode="nearest") / np.maximum(near, 1e-9)
        trust = np.clip(near / 0.1, 0, 1)
        moved = trust * found + (1 - trust) * moved
    return moved
