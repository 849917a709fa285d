"""Fit of the view effects: what the training photos show beyond the asset, as far as it depends on the view alone.

For a pixel with the compositing weights w_i of the layers that it sees at (s_i, t_i), and the direction d to the eye,

    photo - rendering = sum_i w_i sum_k d_k E_ik(s_i, t_i)

is linear in the maps E (clamping aside), the same for all frames, and solved for each colour channel by ridge
regression with conjugate gradients. Pixels that the asset does not cover are left out: there the photo shows the room.
How strong the ridge is, and whether effects help at all, is decided on training cameras that the fit did not see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, cg

from facefolds_core.asset.effects import EffectsPicture, Map
from facefolds_core.asset.writer import LevelContent
from facefolds_core.captures.scene import Scene
from facefolds_core.packaging.views import spread
from facefolds_core.params import ViewEffectParams
from facefolds_core.progress import progress
from facefolds_core.rendering.compositing import FrontToBack
from facefolds_core.rendering.effects import bilinear, to_eye
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import Hits, Texture, sample_texture

_USUAL = ViewEffectParams()

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Equations:
    """Rows of the linear system.

    Attributes:
        matrix: (M, 3 U), U texels of all maps; the columns of x, then y, then z.
        residual: (M, 3).
    """

    matrix: sparse.csr_matrix
    residual: Array

    @classmethod
    def joined(cls, parts: Sequence[Equations]) -> Equations:
        matrix = sparse.vstack([part.matrix for part in parts]).tocsr()
        return cls(matrix, np.concatenate([part.residual for part in parts]))


@dataclass(frozen=True)
class Pixels:
    """Pixels of one camera: hits (1, M, N), directions (M, 3), frame -> photo (M, 3) in [0, 1]."""

    hits: Hits
    eye: Array
    photos: dict[int, Array]


def fit_effects(
    content: LevelContent, scene: Scene, allowed_bytes: float, params: ViewEffectParams = _USUAL
) -> EffectsPicture | None:
    """The view effects of a level, or None where they would not help on cameras that the fit did not see.

    Args:
        allowed_bytes: of the PNG; the resolution is chosen by it.
    """
    cameras = scene.indices("train")
    if len(cameras) < params.validation_every:
        return None
    frames = spread(content.frames, params.frames)
    textures = {frame: content.frame(frame) for frame in frames}
    rays = max(1, params.pixels // (len(cameras) * len(frames)))
    views = _views(content, scene, cameras, frames, rays)
    for downscale in params.downscales:
        sizes = [(-(-layer.crop[3] // downscale), -(-layer.crop[2] // downscale)) for layer in content.layers]
        parts = [
            Equations.joined([_equations(view, textures, sizes, params) for view in of_camera]) for of_camera in views
        ]
        picture = _solved(parts, sizes, params)
        if picture is None or len(picture.png()) <= allowed_bytes:
            return picture
    return None


def _solved(
    parts: Sequence[Equations], sizes: Sequence[tuple[int, int]], params: ViewEffectParams
) -> EffectsPicture | None:
    every, clip = params.validation_every, params.max_residual
    left_out = list(range(every // 2, len(parts), every))
    seen = Equations.joined([part for i, part in enumerate(parts) if i not in left_out])
    unseen = Equations.joined([parts[i] for i in left_out])
    if not len(seen.residual) or not len(unseen.residual):
        return None
    gains = {ridge: _gain(unseen, _ridge(seen, ridge, clip)) for ridge in params.ridges}
    best = max(gains, key=lambda ridge: gains[ridge])
    if gains[best] < params.min_gain:
        return None
    return EffectsPicture.of(_maps(_ridge(Equations.joined(parts), best, clip), sizes))


def _gain(equations: Equations, solution: Array) -> float:
    """dB that a solution wins on equations."""
    after = equations.residual - equations.matrix @ solution
    return float(10 * np.log10((equations.residual**2).mean() / (after**2).mean()))


def _ridge(equations: Equations, ridge: float, clip: float) -> Array:
    """(3 U, 3): argmin |A x - b|^2 + ridge |x|^2, by conjugate gradients with Jacobi's preconditioner."""
    matrix = equations.matrix
    clipped = np.clip(equations.residual, -clip, clip)
    diagonal = np.asarray(matrix.multiply(matrix).sum(0)).ravel() + ridge
    shape = (matrix.shape[1],) * 2
    normal = LinearOperator(shape, matvec=lambda x: matrix.T @ (matrix @ x) + ridge * x, dtype=np.float32)
    jacobi = LinearOperator(shape, matvec=lambda x: x / diagonal, dtype=np.float32)
    columns = [cg(normal, matrix.T @ clipped[:, c], rtol=1e-3, maxiter=40, M=jacobi)[0] for c in range(3)]
    return np.stack(columns, -1).astype(np.float32)


def _maps(solution: Array, sizes: Sequence[tuple[int, int]]) -> list[Map]:
    """(3 U, 3) -> (h, w, 3, 3) a layer."""
    texels = solution.reshape(3, -1, 3).transpose(1, 0, 2)
    ends = np.cumsum([h * w for h, w in sizes])
    parts = np.split(texels, ends[:-1])
    return [np.ascontiguousarray(part.reshape(h, w, 3, 3)) for part, (h, w) in zip(parts, sizes, strict=True)]


def _views(
    content: LevelContent, scene: Scene, cameras: Sequence[int], frames: Sequence[int], rays: int
) -> list[list[Pixels]]:
    """Of each camera with photos, `rays` pixels that hit anything, and what its photos show there: the same pixels in
    all frames; of a head that turns, others in each."""
    meshes, photos = [layer.mesh for layer in content.layers], scene.open_frames()
    rng, views = np.random.default_rng(0), []
    for index in progress(cameras, desc="view effects", unit="camera"):
        of_camera = []
        for together in [list(frames)] if scene.poses is None else [[k] for k in frames]:
            camera = scene.camera_in_head(index, together[0])
            hits = cast_layers(camera, meshes)
            chosen = hits.choose(rng, rays)
            shown = {k: _photo(photos.image(index, k), chosen) for k in together if (index, k) in photos}
            if shown:
                of_camera.append(Pixels(hits.at(chosen), to_eye(camera).reshape(-1, 3)[chosen], shown))
        if of_camera:
            views.append(of_camera)
    return views


def _photo(image: NDArray[np.uint8], pixels: NDArray[np.intp]) -> Array:
    return np.asarray(image.reshape(-1, 3)[pixels] / 255, np.float32)


def _equations(
    view: Pixels, textures: dict[int, list[Texture]], sizes: Sequence[tuple[int, int]], params: ViewEffectParams
) -> Equations:
    """The rows of one camera, all its frames."""
    starts = np.cumsum([0, *(h * w for h, w in sizes)])
    hit = view.hits.hit[0]
    looked_up = [bilinear(view.hits.st[0, hit[:, i], i], size) for i, size in enumerate(sizes)]
    parts = []
    for frame, photo in view.photos.items():
        light, rgb = FrontToBack(len(hit)), np.zeros((len(hit), 3), np.float32)
        rows, columns, values = [], [], []
        for i, (texels, weights) in enumerate(looked_up):
            rays = np.flatnonzero(hit[:, i])
            rgba = sample_texture(textures[frame][i], view.hits.st[0, rays, i])
            w = light.add(rays, rgba[:, 3])
            rgb[rays] += w[:, None] * rgba[:, :3]
            use = w > params.min_weight
            rows.append(np.repeat(rays[use], 4))
            columns.append((starts[i] + texels[use]).ravel())
            values.append((w[use, None] * weights[use]).ravel())
        shape = (len(hit), int(starts[-1]))
        triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        kept = np.flatnonzero(1 - light.transmittance > params.min_opacity)
        weights_matrix = sparse.csr_matrix(triplets, shape, dtype=np.float32)[kept]
        along = [sparse.diags(view.eye[kept, k]) @ weights_matrix for k in range(3)]
        parts.append(Equations(sparse.hstack(along).tocsr(), (photo - rgb)[kept]))
    return Equations.joined(parts)
