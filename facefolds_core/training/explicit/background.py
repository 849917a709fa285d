"""First guess of each camera's static background, without masks."""

from __future__ import annotations

import cv2
import numpy as np
import torch
from torch import Tensor

from facefolds_core.captures.scene import Scene
from facefolds_core.params import BackgroundParams
from facefolds_core.training.explicit.views import Images
from facefolds_core.training.volume.fit import Volume


def first_background(scene: Scene, images: Images, volume: Volume, params: BackgroundParams) -> Tensor:
    """[C, H W, 3] in [0, 1]: the image where the volume is clear, what lies behind the volume elsewhere."""
    h, w = scene.height, scene.width
    frames = sorted({round(k) for k in np.linspace(0, scene.num_frames - 1, params.frames)})
    mean = np.mean([images.frame(k).astype(np.float32) / 255 for k in frames], 0).reshape(-1, h, w, 3)
    rows, columns = -(-h // params.stride), -(-w // params.stride)
    x, y = np.meshgrid((np.arange(columns) + 0.5) * w / columns, (np.arange(rows) + 0.5) * h / rows)
    for image, index in zip(mean, images.cameras, strict=True):
        origins, directions = scene.cameras[index].rays(np.stack([x, y], -1).reshape(-1, 2))
        at = np.broadcast_to(origins, directions.shape).astype(np.float32)
        along = directions.astype(np.float32)
        _, alpha, _ = volume.render(at, along)
        behind = volume.behind(at, along)
        full = [cv2.resize(a.reshape(rows, columns, -1), (w, h)) for a in (alpha, behind)]
        covered = full[0] >= params.max_opacity
        image[covered] = full[1][covered]
    return torch.from_numpy(mean.reshape(len(mean), h * w, 3).astype(np.float32))
