"""First guess of each camera's static background, without masks."""

from __future__ import annotations

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import BackgroundParams
from facefolds_core.spacing import spread
from facefolds_core.training.explicit.views import Images
from facefolds_core.training.volume.fit import Volume

Array = NDArray[np.float32]


def first_background(scene: Scene, images: Images, volume: Volume, params: BackgroundParams) -> Tensor:
    """[C, H W, 3] in [0, 1]: the clean plate; without one the image where the volume is clear, what lies behind the
    volume elsewhere.

    Of a head that turns: the mean of the frames in which the volume, turned with it, is clear.
    """
    h, w = scene.height, scene.width
    wanted = params.frames if scene.poses is None else params.moving_frames
    frames = spread(range(scene.num_frames), wanted)
    if scene.poses is None:
        mean = np.mean([images.frame(k).astype(np.float32) / 255 for k in frames], 0).reshape(-1, h, w, 3)
        covered = [_opacity(scene.cameras[c], volume, params) >= params.max_opacity for c in images.cameras]
    else:
        mean, covered = _clear_mean(scene, images, volume, params, frames)
    for image, hidden, index in zip(mean, covered, images.cameras, strict=True):
        at, along = _lattice(scene.camera_in_head(index, volume.frame), params)
        image[hidden] = _enlarged(volume.behind(at, along), scene.cameras[index], params)[hidden]
    for image, plate in zip(mean, images.plates(), strict=True):
        if plate is not None:
            image[:] = plate.reshape(h, w, 3).astype(np.float32) / 255
    return torch.from_numpy(mean.reshape(len(mean), h * w, 3).astype(np.float32))


def _clear_mean(
    scene: Scene, images: Images, volume: Volume, params: BackgroundParams, frames: list[int]
) -> tuple[Array, list[NDArray[np.bool_]]]:
    """(C, H, W, 3) mean over the frames in which a pixel is clear, and of each camera (H, W) where there is none."""
    shape = (len(images.cameras), scene.height, scene.width)
    total, count = np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32)
    for k in frames:
        pictures = images.frame(k).reshape(*shape, 3)
        for c, index in enumerate(images.cameras):
            clear = _opacity(scene.camera_in_head(index, k), volume, params) < params.max_opacity
            total[c][clear] += pictures[c][clear].astype(np.float32) / 255
            count[c] += clear
    mean = (total / np.maximum(count, 1)[..., None]).astype(np.float32)
    return mean, [one == 0 for one in count]


def _lattice(camera: Camera, params: BackgroundParams) -> tuple[Array, Array]:
    """Origins and directions (R, 3) of rays at every so-manieth pixel."""
    rows, columns = _size(camera, params)
    x = (np.arange(columns) + 0.5) * camera.width / columns
    y = (np.arange(rows) + 0.5) * camera.height / rows
    origins, directions = camera.rays(np.stack(np.meshgrid(x, y), -1).reshape(-1, 2))
    return np.broadcast_to(origins, directions.shape).astype(np.float32), directions.astype(np.float32)


def _size(camera: Camera, params: BackgroundParams) -> tuple[int, int]:
    return -(-camera.height // params.stride), -(-camera.width // params.stride)


def _enlarged(values: Array, camera: Camera, params: BackgroundParams) -> Array:
    """(R,) or (R, Q) at the lattice -> (H, W) or (H, W, Q)."""
    found = cv2.resize(values.reshape(*_size(camera, params), -1), (camera.width, camera.height))
    return np.asarray(found, np.float32)


def _opacity(camera: Camera, volume: Volume, params: BackgroundParams) -> Array:
    """(H, W) of the volume."""
    _, alpha, _ = volume.render(*_lattice(camera, params))
    return _enlarged(alpha, camera, params)
