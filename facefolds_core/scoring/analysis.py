"""What the layers of an asset do in its pictures: angles at which they are seen, shares of each, where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset import Asset
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.sphere_uv import st_to_uv, uv_to_directions
from facefolds_core.rendering import Hits
from facefolds_core.rendering.compositing import FrontToBack
from facefolds_core.rendering.intersection import MISS, EmbreeMesh
from facefolds_core.rendering.reference import Mesh, Texture, sample_texture
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.record import AngleBin, Seen, Shape, Spacing

VISIBLE = 1 / 255
"""The least weight that can change a pixel of 8 bits."""
ANGLE_EDGES = (0, 15, 30, 45, 60, 75, 90)
"""Degrees between the view and the surface's normal."""
SPACING_GRID = 48
"""Rays a side through which the layers' spacing is measured."""
SECTION_RAYS = 181


def weights(hits: Hits, textures: Sequence[Texture]) -> NDArray[np.float32]:
    """w_i = alpha_i prod_{k<i} (1 - alpha_k) of each pixel and layer, (H, W, N)."""
    result = np.zeros(hits.hit.shape, np.float32)
    light = FrontToBack(hits.hit.shape[:2])
    for i, texture in enumerate(textures):
        hit = hits.hit[..., i]
        alpha = sample_texture(texture[..., 3:], hits.st[..., i, :][hit])[:, 0]
        result[..., i][hit] = light.add(hit, alpha)
    return result


def view_angles(camera: Camera, meshes: Sequence[EmbreeMesh], layer_weights: NDArray[np.float32]) -> Array:
    """Degrees, 0 to 90, between each pixel's ray and the normal of the layer that adds most to it.

    Args:
        meshes: N layers.
        layer_weights: (H, W, N).

    Returns:
        (H, W); NaN where no layer adds at least VISIBLE.
    """
    directions = camera.rays()[1]
    strongest = np.where(layer_weights.max(-1) >= VISIBLE, layer_weights.argmax(-1), MISS)
    angles = np.full(strongest.shape, np.nan)
    for i, mesh in enumerate(meshes):
        rows, columns = np.nonzero(strongest == i)
        rays = directions[rows, columns]
        triangle = mesh.nearest(np.broadcast_to(camera.centre, rays.shape), rays).triangle
        normals = face_normals(mesh.triangles)[triangle]
        cosine = np.where(triangle == MISS, np.nan, np.abs((normals * rays).sum(-1)))
        angles[rows, columns] = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    return angles


def face_normals(triangles: Array) -> Array:
    """Unit normals (F, 3) of triangles (F, 3, 3); NaN for those without area."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.asarray(np.divide(normals, length, out=np.full_like(normals, np.nan), where=length > 0))


class Sums:
    """Running sums over pixels, weighted with the subject's opacity."""

    def __init__(self, layers: Sequence[Mesh]) -> None:
        self._meshes = [EmbreeMesh(layer.vertices, layer.faces) for layer in layers]
        # One more than the bins: pixels without a surface. Columns: weight, |error|, error squared.
        self._angles = np.zeros((len(ANGLE_EDGES), 3))
        self._seen, self._reached, self._greatest = np.zeros((3, len(layers)))
        self._masked = True

    def add_picture(
        self, camera: Camera, hits: Hits, textures: Sequence[Texture], error: Array, mask: Array | None
    ) -> None:
        """A rendering of the asset: its hits and textures, its error (H, W, 3), the subject's opacity (H, W)."""
        layer_weights = weights(hits, textures)
        region = layer_weights.sum(-1, dtype=np.float64) if mask is None else mask
        self._masked &= mask is not None
        self.add(region, error, layer_weights, view_angles(camera, self._meshes, layer_weights))

    def add(self, region: Array, error: Array, layer_weights: NDArray[np.float32], angles: Array) -> None:
        """A picture: region (H, W), error (H, W, 3), layer_weights (H, W, N), angles (H, W) with NaN."""
        where = np.searchsorted(ANGLE_EDGES[1:-1], angles, side="right")
        where = np.where(np.isnan(angles), len(ANGLE_EDGES) - 1, where)
        values = np.stack([np.ones_like(region), np.abs(error).mean(-1), (error**2).mean(-1)], -1)
        np.add.at(self._angles, where, region[..., None] * values)
        self._seen += np.einsum("hw,hwn->n", region, layer_weights)
        self._reached += np.einsum("hw,hwn->n", region, layer_weights >= VISIBLE)
        self._greatest = np.maximum(self._greatest, layer_weights.max((0, 1)))

    def result(self) -> Seen:
        total = max(float(self._angles[:, 0].sum()), 1e-12)
        edges = [*pairwise(ANGLE_EDGES), (0, 90)]
        bins = [_bin(low, high, row, total) for (low, high), row in zip(edges, self._angles, strict=True)]
        return Seen(
            angles=tuple(bins[:-1]),
            bare=bins[-1],
            contribution=tuple((self._seen / max(float(self._seen.sum()), 1e-12)).tolist()),
            reach=tuple((self._reached / total).tolist()),
            greatest=tuple(self._greatest.tolist()),
            masked=self._masked,
        )


def _bin(low: float, high: float, row: Array, total: float) -> AngleBin:
    weight = float(row[0])
    if weight <= 0:
        return AngleBin(low, high, 0.0, None, None)
    return AngleBin(low, high, weight / total, float(row[1]) / weight, float(np.sqrt(row[2] / weight)))


def radii(layers: Sequence[Mesh], centre: Array, directions: Array) -> Array:
    """Distance of each layer from `centre` along directions (..., 3): (..., N), NaN where a layer is not met."""
    flat = np.reshape(directions, (-1, 3))
    result = np.full((len(flat), len(layers)), np.nan)
    for i, layer in enumerate(layers):
        mesh = EmbreeMesh(layer.vertices, layer.faces)
        found = mesh.nearest(np.broadcast_to(centre, flat.shape), flat)
        hit = found.triangle != MISS
        points = np.einsum("rk,rkc->rc", found.barycentric[hit], mesh.triangles[found.triangle[hit]])
        result[hit, i] = np.linalg.norm(points - centre, axis=-1)
    return result.reshape(*np.shape(directions)[:-1], len(layers))


def spacings(radius: Array) -> list[Spacing]:
    """Between neighbours, outermost first: N - 1 of them.

    Args:
        radius: (..., N) as of `radii`.
    """
    gaps = -np.diff(radius.reshape(-1, radius.shape[-1]), axis=-1)
    known = [column[np.isfinite(column)] for column in gaps.T]
    return [Spacing(float(g.mean()), float(g.min())) if len(g) else Spacing(None, None) for g in known]


def shape_of(asset: Asset) -> Shape:
    """By rays from the sphere centre: a grid over the layers' common window, and two arcs through its middle; what a
    chart's belt has below the lower pole is left out."""
    centre = np.array(asset.manifest.coordinates.sphere_centre)
    windows = np.array([layer.uv_window for layer in asset.manifest.full.layers])
    window = max(windows[:, 0].min(), -1.0), min(windows[:, 1].max(), 1.0), windows[:, 2].min(), windows[:, 3].max()
    steps = (np.arange(SPACING_GRID) + 0.5) / SPACING_GRID
    grid = uv_to_directions(st_to_uv(np.stack(np.meshgrid(steps, steps), -1), window))
    line, zero = np.linspace(0, 1, SECTION_RAYS), np.zeros(SECTION_RAYS)
    upright = uv_to_directions(np.stack([window[0] + line * (window[1] - window[0]), zero], -1))
    level = uv_to_directions(np.stack([zero, window[2] + line * (window[3] - window[2])], -1))
    sections = {}
    for name, axes, directions in (("from the side", (0, 2), upright), ("from above", (1, 0), level)):
        points = centre + radii(asset.layers, centre, directions)[..., None] * directions[:, None]
        sections[name] = points[..., list(axes)].transpose(1, 0, 2)
    return Shape(tuple(spacings(radii(asset.layers, centre, grid))), sections)
