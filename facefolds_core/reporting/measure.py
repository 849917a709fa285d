"""What no file holds: measured by rendering the asset, as shipped, from held-out cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering import AssetCaster, Hits, composite
from facefolds_core.rendering.intersection import MISS, EmbreeMesh
from facefolds_core.rendering.reference import Mesh, Texture, sample_texture
from facefolds_core.scoring.evaluation import frame_rate_factor
from facefolds_core.scoring.metrics import Array, psnr, shown

VISIBLE = 1 / 255
"""The least weight that can change a pixel of 8 bits."""
ANGLE_EDGES = (0, 15, 30, 45, 60, 75, 90)
"""Degrees between the view and the surface's normal."""


@dataclass(frozen=True)
class View:
    """One held-out picture: images (H, W, 3) in [0, 1], mask (H, W) or None; dB as in docs/metrics.md."""

    camera: str
    frame: str
    truth: Array
    asset: Array
    mask: Array | None
    psnr: float | None
    psnr_subject: float | None


@dataclass(frozen=True)
class AngleBin:
    """Pixels of the subject whose surface is seen at `low` to `high` degrees from its normal.

    Attributes:
        share: of all pixels of the subject.
        mean, rms: absolute and root mean square error of R, G and B in [0, 1]; None where there are no such pixels.
    """

    low: float
    high: float
    share: float
    mean: float | None
    rms: float | None


@dataclass(frozen=True)
class Measured:
    """Sums over the views.

    Attributes:
        angles: by ANGLE_EDGES.
        bare: pixels of the subject that meet no visible layer, as a bin of all angles.
        contribution: (N,) share of each layer in what is seen of the subject, sums to 1.
        reach: (N,) share of the subject's pixels to which the layer adds at least VISIBLE.
        greatest: (N,) largest weight in any pixel: leaving the layer out changes no colour by more.
        masked: whether the subject is known from masks; else it is where the asset is opaque.
    """

    views: tuple[View, ...]
    angles: tuple[AngleBin, ...]
    bare: AngleBin
    contribution: tuple[float, ...]
    reach: tuple[float, ...]
    greatest: tuple[float, ...]
    masked: bool


def measure(
    scene: Scene, asset: Asset, pairs: Sequence[tuple[int, int]], background: tuple[float, float, float]
) -> Measured:
    """Render and measure.

    Args:
        pairs: (camera index, frame index) of the pictures; the scene has a photo of each.
        background: RGB behind the asset, as in `evaluate`.
    """
    truths, masks = scene.open_frames(), scene.open_masks()
    caster, meshes = AssetCaster(asset), [EmbreeMesh(layer.vertices, layer.faces) for layer in asset.layers]
    factor = frame_rate_factor(scene, asset)
    textures = {k: asset.frame(k * factor) for k in sorted({k for _, k in pairs})}
    sums, views = Sums(asset.num_layers), []
    for index in dict.fromkeys(camera for camera, _ in pairs):
        camera = scene.cameras[index]
        hits = caster.cast(camera)
        for k in [frame for i, frame in pairs if i == index]:
            truth = truths.image(index, k) / 255.0
            mask = masks.image(index, k)[..., 0] / 255.0 if masks is not None and (index, k) in masks else None
            rgb, alpha = composite(hits, textures[k], background)
            image, layer_weights = shown(rgb), weights(hits, textures[k])
            scores = psnr(image, truth), None if mask is None else psnr(image, truth, mask)
            views.append(View(camera.name, scene.frame_ids[k], truth, image, mask, *scores))
            region = np.asarray(alpha, np.float64) if mask is None else mask
            sums.add(region, image - truth, layer_weights, view_angles(camera, meshes, layer_weights))
    return sums.result(views)


def weights(hits: Hits, textures: Sequence[Texture]) -> NDArray[np.float32]:
    """w_i = alpha_i prod_{k<i} (1 - alpha_k) of each pixel and layer, (H, W, N)."""
    result = np.zeros(hits.hit.shape, np.float32)
    transmittance = np.ones(hits.hit.shape[:2], np.float32)
    for i, texture in enumerate(textures):
        hit = hits.hit[..., i]
        alpha = sample_texture(texture[..., 3:], hits.st[..., i, :][hit])[:, 0]
        result[..., i][hit] = transmittance[hit] * alpha
        transmittance[hit] *= 1 - alpha
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

    def __init__(self, layers: int) -> None:
        # One more than the bins: pixels without a surface. Columns: weight, |error|, error squared.
        self._angles = np.zeros((len(ANGLE_EDGES), 3))
        self._seen, self._reached, self._greatest = np.zeros(layers), np.zeros(layers), np.zeros(layers)

    def add(self, region: Array, error: Array, layer_weights: NDArray[np.float32], angles: Array) -> None:
        """A picture: region (H, W), error (H, W, 3), layer_weights (H, W, N), angles (H, W) with NaN."""
        where = np.searchsorted(ANGLE_EDGES[1:-1], angles, side="right")
        where = np.where(np.isnan(angles), len(ANGLE_EDGES) - 1, where)
        values = np.stack([np.ones_like(region), np.abs(error).mean(-1), (error**2).mean(-1)], -1)
        np.add.at(self._angles, where, region[..., None] * values)
        self._seen += np.einsum("hw,hwn->n", region, layer_weights)
        self._reached += np.einsum("hw,hwn->n", region, layer_weights >= VISIBLE)
        self._greatest = np.maximum(self._greatest, layer_weights.max((0, 1)))

    def result(self, views: Sequence[View]) -> Measured:
        total = max(float(self._angles[:, 0].sum()), 1e-12)
        edges = [*pairwise(ANGLE_EDGES), (0, 90)]
        bins = [_bin(low, high, row, total) for (low, high), row in zip(edges, self._angles, strict=True)]
        return Measured(
            views=tuple(views),
            angles=tuple(bins[:-1]),
            bare=bins[-1],
            contribution=tuple((self._seen / max(float(self._seen.sum()), 1e-12)).tolist()),
            reach=tuple((self._reached / total).tolist()),
            greatest=tuple(self._greatest.tolist()),
            masked=all(view.mask is not None for view in views),
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


@dataclass(frozen=True)
class Spacing:
    """From a layer to the next one inwards, along rays from the sphere centre; units of the normalised world.

    Attributes:
        mean, least: None where the two are never met by one ray. A negative `least` means that they cross.
    """

    mean: float | None
    least: float | None


def spacings(radius: Array) -> list[Spacing]:
    """Between neighbours, outermost first: N - 1 of them.

    Args:
        radius: (..., N) as of `radii`.
    """
    gaps = -np.diff(radius.reshape(-1, radius.shape[-1]), axis=-1)
    known = [column[np.isfinite(column)] for column in gaps.T]
    return [Spacing(float(g.mean()), float(g.min())) if len(g) else Spacing(None, None) for g in known]
