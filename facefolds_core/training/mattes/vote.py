"""What pictures agree on: each votes on the voxels that it sees, and bad cut-outs are outvoted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import VoteParams
from facefolds_core.training.mattes.cut_out import grown, opacity_in, pixels
from facefolds_core.training.volume import kernel
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.subject import positions

Image = NDArray[np.uint8]


def agreed(volume: Volume, cameras: Sequence[Camera], cut_outs: Sequence[Image], params: VoteParams) -> Volume:
    """The visual hull that enough pictures agree on, as a volume that is solid there and empty elsewhere.

    Args:
        volume: whose grid it has, twice as coarse, and near whose body the hull stays.
        cameras: of the cut-outs' sizes.
        cut_outs: (H, W) 1 where the subject is.
    """
    # Every second voxel: pictures agree on shapes, hair is theirs.
    volume = replace(volume, grid=volume.grid[::2, ::2, ::2], voxel=2 * volume.voxel)
    points = positions(volume).reshape(-1, 3)
    seen, inside = np.zeros(len(points), np.int32), np.zeros(len(points), np.int32)
    for camera, picture in zip(cameras, cut_outs, strict=True):
        pixels, depth = camera.project(points)
        x, y = (np.floor(np.where(depth > 0, pixels[:, axis], -1.0)).clip(-1, 1 << 20).astype(int) for axis in (0, 1))
        there = (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
        seen += there
        inside[there] += picture[y[there], x[there]]
    kept = (seen >= params.min_views) & (inside >= params.share * seen)
    body = np.logaddexp(0, volume.grid[..., 0]) > params.body_depth
    near = ndimage.distance_transform_edt(~body, sampling=volume.voxel) <= params.near
    grid = np.zeros_like(volume.grid)
    grid[..., 0] = np.where(kept.reshape(near.shape) & near, kernel.LIMIT, -kernel.LIMIT)
    return replace(volume, grid=grid)


def outvoted(
    hull: Volume, cameras: Sequence[Camera], cut_outs: Sequence[Image], params: VoteParams
) -> tuple[list[Image], NDArray[np.float64]]:
    """Cut-outs without what the pictures do not agree on, and IoU (P,) of each, as it was, with what they agree on."""
    mended, agreement = [], np.zeros(len(cut_outs))
    for number, (camera, picture) in enumerate(zip(cameras, cut_outs, strict=True)):
        silhouette = (opacity_in(hull, camera) > 0.5).astype(np.uint8)
        union = int((silhouette | picture).sum())
        agreement[number] = int((silhouette & picture).sum()) / union if union else 1.0
        mended.append(picture & grown(silhouette, pixels(params.grow, picture)))
    return mended, agreement
