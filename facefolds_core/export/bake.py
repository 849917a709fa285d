"""Textures fitted to the very meshes that ship, so that what decimation changed is taken up by the texels.

1. *Reprojection.* Texture coordinates are exact at a mesh's vertices and linear between them, directions from c are
   not. So a texel lies at a point of the mesh whose direction is a little different from its own; it gets what the
   layer has there.
2. *Fit.* The rays of all training cameras are cast at the meshes once, and at the sampled sheets (`sheets`), which show
   what the model shows. Then, frame by frame, texels move so that the meshes' colour over black and transmittance
   become those of the sheets. A step is x -= sum J r / (damping + sum |J| row): a ray's residual r is spread over its
   texels, and a texel takes the mean of what its rays ask for (SIRT; Gregor and Benson 2008). Residuals are those of
   texels rounded to 8 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.export.bake_kernel import accumulate, render, true_positions, update
from facefolds_core.export.sheets import sheet_faces, sheet_mesh, vertex_uv
from facefolds_core.export.stores import Sheets
from facefolds_core.export.textures import fill_colour, premultiply, straight
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.kernels.hit_codes import encode
from facefolds_core.progress import progress as progress_bar
from facefolds_core.rendering.raster import cast_mesh

DAMPING = 0.05
"""Added to a texel's sum of weights: what is hardly seen hardly moves."""

MIN_LIGHT = 0.001
"""Layers behind less transmittance are left out of the fit."""

Image = NDArray[np.uint8]
Codes = NDArray[np.uint16]
Float = NDArray[np.float32]


@dataclass(frozen=True)
class Rays:
    """P rays and where they meet each of N layers, as 16-bit texture coordinates (0 where they miss it).

    Attributes:
        shipped: (P, N, 2) uint16, on the meshes that ship.
        sampled: (P, N, 2) uint16, on the sheets that they came from.
    """

    shipped: Codes
    sampled: Codes


def gather_rays(
    cameras: Sequence[Camera], meshes: Sequence[TexturedMesh], sheets: Sheets, progress: bool = True
) -> Rays:
    """All pixels of all cameras that meet something that shows, on the meshes or on the sheets."""
    sources = showing_meshes(sheets)
    alpha = np.zeros((*sheets.opacity.shape, 4), np.float32)
    alpha[..., 3] = sheets.opacity
    shipped, sampled = [], []
    for camera in progress_bar(cameras, desc="rays", unit="camera", disable=not progress):
        own, theirs = cast_codes(camera, meshes), cast_codes(camera, sources)
        shows = (transmittance(own, alpha) < 1) | (transmittance(theirs, alpha) < 1)
        shipped.append(own[shows])
        sampled.append(theirs[shows])
    return Rays(np.concatenate(shipped), np.concatenate(sampled))


def transmittance(codes: Codes, textures: Float) -> Float:
    """(P,) of rays through textures (N, H, W, 4) in [0, 255]."""
    out = np.empty((len(codes), 4), np.float32)
    render(codes, textures, out)
    return out[:, 3]


def showing_meshes(sheets: Sheets) -> list[TexturedMesh]:
    """The sheets' faces with a corner that is not transparent in all frames."""
    faces, uv = sheet_faces(sheets), vertex_uv(sheets)
    meshes = []
    for layer in range(sheets.num_layers):
        shows = (sheets.opacity[layer] > 0).reshape(-1)[faces].any(1)
        known = sheets.valid[layer].reshape(-1)[faces].all(1)
        meshes.append(sheet_mesh(sheets, layer, faces[shows & known], uv))
    return meshes


def cast_codes(camera: Camera, meshes: Sequence[TexturedMesh]) -> Codes:
    """(H W, N, 2): where the rays through all pixel centres meet each layer."""
    codes = np.zeros((camera.height * camera.width, len(meshes), 2), np.uint16)
    for layer, mesh in enumerate(meshes):
        hit = np.zeros((camera.height, camera.width), bool)
        st = np.zeros((camera.height, camera.width, 2), np.float32)
        cast_mesh(camera, mesh, hit, st)
        codes[hit.reshape(-1), layer] = encode(st[hit])
    return codes


def reprojection(mesh: TexturedMesh, sheets: Sheets, size: int) -> Float:
    """(size, size, 2) columns and rows: where in the layer's texture what belongs to each texel of the mesh's lies."""
    row, column = np.mgrid[:size, :size].astype(np.float32)
    positions = np.stack([column, row], -1)
    offsets = mesh.vertices.astype(np.float64) - np.array(sheets.chart.centre)
    st, belt = mesh.st.astype(np.float64), sheets.chart.numbers
    true_positions(offsets, mesh.faces, st, sheets.window, belt, positions)
    return positions


def reproject(image: Image, positions: Float) -> Image:
    """A texture looked up at other positions, bicubic in premultiplied alpha."""
    moved = cv2.remap(
        premultiply(image), positions[..., 0], positions[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return straight(np.asarray(moved, np.float32).clip(0, 1))


class Baker:
    """Fits textures frame by frame.

    Args:
        meshes: that ship, N layers.
        sheets: that they came from.
        rays: of the training cameras.
        size: texels a side of the shipped textures.
    """

    def __init__(self, meshes: Sequence[TexturedMesh], sheets: Sheets, rays: Rays, size: int) -> None:
        self.rays = rays
        self._positions = [reprojection(mesh, sheets, size) for mesh in meshes]
        self._sums: Float = np.zeros((len(meshes), size, size, 6), np.float32)

    def frame(self, textures: Image, samples: Image, iterations: int) -> Image:
        """One frame's textures.

        Args:
            textures: (N, size, size, 4) uint8, to start from.
            samples: (N, R, R, 4) uint8, the sheets'.
            iterations: steps.

        Returns:
            (N, size, size, 4) uint8.
        """
        target = np.empty((len(self.rays.sampled), 4), np.float32)
        render(self.rays.sampled, samples.astype(np.float32), target)
        moved = np.stack([reproject(image, p) for image, p in zip(textures, self._positions, strict=True)])
        values = moved.astype(np.float32) / np.float32(255)
        shown = values.copy()
        for _ in range(iterations):
            accumulate(self.rays.shipped, target, shown, self._sums, MIN_LIGHT)
            update(values.reshape(-1, 4), self._sums.reshape(-1, 6), DAMPING, shown.reshape(-1, 4))
        return np.stack([_finished(image) for image in shown])


def _finished(shown: Float) -> Image:
    """8 bits; texels that are transparent take their colour from around."""
    image = np.rint(shown * 255).astype(np.uint8)
    hidden = image[..., 3] == 0
    premultiplied = np.concatenate([shown[..., :3] * shown[..., 3:], shown[..., 3:]], -1)
    image[hidden, :3] = np.rint(fill_colour(premultiplied, ~hidden)[hidden] * 255)
    return image


def baked_frame(baker: Baker, textures: FrameStore, samples: FrameStore, frame: int, iterations: int) -> Image:
    """(N, size, size, 4) of one frame.

    Args:
        textures, samples: layered frame stores (camera := layer) of the same layers and frames.
        iterations: steps.
    """
    layers = range(baker.rays.shipped.shape[1])
    own, theirs = (np.stack([store.image(n, frame) for n in layers]) for store in (textures, samples))
    return baker.frame(own, theirs, iterations)
