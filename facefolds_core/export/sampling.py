"""Sample a model: grids of surface points with normals, and texture frames (paper, "Exporting Layered Meshes").

Only the model's own interface is used, so that any model can be exported.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.errors import UserError
from facefolds_core.export.bilinear import Projection
from facefolds_core.export.stores import Grids
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window, row_strides, texel_uv, uv_to_st
from facefolds_core.progress import progress
from facefolds_core.system.threads import in_order

if TYPE_CHECKING:
    from facefolds_core.model.radiance import RadianceManifolds

DIRECTIONS_AT_ONCE = 16384
"""Directions searched for surfaces at a time: bounds the memory, and paces the progress bar."""

LEAST = 512
"""Least R that `sample.resolution: auto` takes."""

Array = NDArray[np.float64]
Single = NDArray[np.float32]


def samples_for(model: RadianceManifolds, window: Window) -> int:
    """R of `sample.resolution: auto`: no texel of the model over the window is lost, up to 4096."""
    grid = model.texel_grid()
    if grid is None:
        return LEAST
    own, (rows, columns) = grid.window, grid.shape
    height, width = (window[1] - window[0]) / (own[1] - own[0]), (window[3] - window[2]) / (own[3] - own[2])
    return max(LEAST, min(4096, 64 * math.ceil(max(rows * height, columns * width) / 64 - 1e-6)))


def sample_grids(model: RadianceManifolds, resolution: int, window: Window) -> Grids:
    """N grids of R x R points at the texel centres of `window`, with normals.

    Args:
        model: asked for its `surface_points`.
        resolution: R.
        window: (u0, u1, v0, v1), the same for all layers.

    Raises:
        UserError: if the model gives a point that is not finite, or a layer has no point at all.

    Returns:
        the grids, opaque wherever they are valid: `write_textures` finds out what is not.
    """
    centre = model.centre.detach()
    uv = torch.as_tensor(texel_uv(resolution, resolution, window).reshape(-1, 2)).to(centre)
    points = np.zeros((model.num_layers, resolution, resolution, 3), np.float32)
    valid = np.zeros((model.num_layers, resolution, resolution), bool)
    flat_points, flat_valid = points.reshape(model.num_layers, -1, 3), valid.reshape(model.num_layers, -1)
    with torch.no_grad(), progress(total=len(uv), desc="points", unit="direction") as bar:
        for start in range(0, len(uv), DIRECTIONS_AT_ONCE):
            stop = start + DIRECTIONS_AT_ONCE
            found, hit = model.surface_points(uv[start:stop])
            flat_points[:, start:stop] = np.where(hit.cpu().numpy()[..., None], found.cpu().numpy(), 0.0)
            flat_valid[:, start:stop] = hit.cpu().numpy()
            bar.update(len(uv[start:stop]))
    _check_points(points, valid)
    normals = np.stack([grid_normals(p, v, model.chart, window) for p, v in zip(points, valid, strict=True)])
    windows = np.tile(np.array(window, np.float64), (model.num_layers, 1))
    return Grids(points, normals.astype(np.float32), valid, valid.astype(np.uint8) * 255, windows, model.chart)


AGAIN = "train again, with lower learning rates or another seed"


def _check_points(points: NDArray[np.float32], valid: NDArray[np.bool_]) -> None:
    for layer, (p, v) in enumerate(zip(points, valid, strict=True)):
        if not np.isfinite(p).all():
            message = "the model's surface has points that are not finite"
            found = f"{int((~np.isfinite(p)).any(-1).sum())} points with NaN or infinity"
            raise UserError(message, place=f"layer {layer}", expected="finite coordinates", found=found, remedy=AGAIN)
        if not v.any():
            raise UserError(
                "a layer has no surface in any sampled direction",
                place=f"layer {layer} (0 is the outermost)",
                expected="a surface within the model's window",
                found="no crossing",
                remedy="train longer, with fewer layers (train.layers) or a smaller distance between them "
                "(train.geometry.halfwidth; train.level_halfwidth of the perceptrons)",
            )


def grid_normals(points: NDArray[np.float32], valid: NDArray[np.bool_], chart: Chart, window: Window) -> Array:
    """Unit outward normals from neighbouring samples.

    The normal is the cross product of two chords, from the previous to the next sample down the column and along the
    row; where one of the two does not exist (border, invalid neighbour) the sample itself stands for it. Near the poles
    a row's samples crowd together, so its chords span more columns, about as long as a column's. A sample without
    usable neighbours gets the direction of its ray.

    Args:
        points: (R, R, 3).
        valid: (R, R).
        chart: outward means along its rays.
        window: (u0, u1, v0, v1).

    Returns:
        (R, R, 3) float64; also where `valid` is false (the direction of its ray).
    """
    r = len(points)
    p = points.astype(np.float64)
    rows, columns = np.meshgrid(np.arange(r), np.arange(r), indexing="ij")
    stride = np.minimum(row_strides(r, window, chart.lowest), max(r // 8, 1))[:, None]

    def neighbour(i: NDArray[np.intp], j: NDArray[np.intp]) -> Array:
        i, j = i.clip(0, r - 1), j.clip(0, r - 1)
        return np.where(valid[i, j][..., None], p[i, j], p)

    down = neighbour(rows + 1, columns) - neighbour(rows - 1, columns)
    right = neighbour(rows, columns + stride) - neighbour(rows, columns - stride)
    normal = np.cross(down, right)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    outward = chart.directions(texel_uv(r, r, window))
    # Parallel or missing chords: the product's length is rounding error next to the chords'.
    scale = np.linalg.norm(down, axis=-1, keepdims=True) * np.linalg.norm(right, axis=-1, keepdims=True)
    usable = valid[..., None] & (length > 1e-3 * scale) & (scale > 0)
    normal = np.where(usable, normal / np.where(usable, length, 1), outward)
    return np.where((normal * outward).sum(-1, keepdims=True) < 0, -normal, normal)


def texture_rows(model: RadianceManifolds, grids: Grids) -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
    """Texture images: frame by frame, in each the layers from the outermost in.

    Yields:
        (layer, frame, (R, R, 4) uint8 RGBA, straight alpha). Alpha is 0 where the layer has no point.

    Raises:
        UserError: if the model gives a colour or an alpha that is not finite.
    """
    images = [_images(model, n, grids.window(n), grids.valid[n]) for n in range(grids.num_layers)]

    each = progress(range(model.num_frames), desc="textures", unit="frame")

    def row(layer: int, frame: int, values: Single) -> tuple[int, int, NDArray[np.uint8]]:
        return layer, frame, images[layer][1](values)

    return in_order(partial(row, n, frame, texels(frame)) for frame in each for n, (texels, _) in enumerate(images))


def _images(
    model: RadianceManifolds, layer: int, window: Window, valid: NDArray[np.bool_]
) -> tuple[Callable[[int], Single], Callable[[Single], NDArray[np.uint8]]]:
    """What the model shows of a layer in a frame, (M, 4); and what makes (R, R, 4) RGBA in its window of that: of a
    model with texels, those that interpolate to it; of others, its values."""
    grid, size = model.texel_grid(), len(valid)
    if grid is None:
        places = texel_uv(size, size, window)[valid]
    else:
        places = texel_uv(grid.shape[0], grid.shape[1], grid.window).reshape(-1, 2)
        corners = np.array([[window[1], window[2]], [window[0], window[3]]])
        (left, top), (right, bottom) = np.asarray(uv_to_st(corners, grid.window)).tolist()
        projection = Projection(grid.shape, (size, size), (top, bottom, left, right))

    def texels(frame: int) -> Single:
        return _texels(model, torch.as_tensor(places).to(model.centre.detach()), layer, frame)

    def drawn(values: Single) -> NDArray[np.uint8]:
        if grid is not None:
            values = projection(values.reshape(*grid.shape, 4))[valid]
        found = np.zeros((*valid.shape, 4), np.uint8)
        found[valid] = np.rint(values * np.float32(255))
        return found

    return texels, drawn


@torch.no_grad()
def _texels(model: RadianceManifolds, uv: Tensor, layer: int, frame: int) -> Single:
    """(M, 4) RGBA in [0, 1] at uv [M, 2]."""
    rgb, alpha = model.texture(uv, layer, float(frame))
    rgba = torch.cat([rgb, alpha[:, None]], -1)
    if not torch.isfinite(rgba).all():
        raise UserError(
            "the model's texture has values that are not finite",
            place=f"layer {layer}, frame {frame}",
            expected="colours and alpha in [0, 1]",
            found="NaN or infinity",
            remedy=AGAIN,
        )
    return np.asarray(rgba.clamp(0, 1).cpu().numpy(), np.float32)


def write_textures(path: Path, model: RadianceManifolds, grids: Grids) -> NDArray[np.uint8]:
    """Write all texture images to a layered frame store (camera := layer), holding a few in memory.

    Returns:
        (N, R, R) largest alpha of any frame.
    """
    opacity = np.zeros(grids.valid.shape, np.uint8)

    def rows() -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
        for layer, frame, image in texture_rows(model, grids):
            np.maximum(opacity[layer], image[..., 3], out=opacity[layer])
            yield layer, frame, image

    write_frames(path, (grids.resolution, grids.resolution, 4), rows(), packed=True)
    return opacity
