"""First guess of each camera's static background, without masks."""

from __future__ import annotations

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

from facefolds_core.captures.scene import Scene
from facefolds_core.training.explicit.views import Images, Views

REDUCE = 4
"""The guess is made on every 4th pixel."""


def first_background(scene: Scene, images: Images, views: Views) -> Tensor:
    """[C, H W, 3] in [0, 1]: what is seen where no layer is crossed, continued smoothly behind the layers.

    Pixels that miss all layers show the background. The others take a mean of these, weighted by a Gaussian that is
    widened until it reaches some (a camera that has none takes the mean of all cameras that have).

    Args:
        views: of every pixel (stride 1).
    """
    h, w = scene.height, scene.width
    colours = images.frame(0).reshape(-1, h, w, 3)
    result = np.zeros((len(colours), h, w, 3), np.float32)
    seen = np.zeros((len(colours), h * w), bool)
    seen[views.camera, views.pixel] = True
    free = ~seen.reshape(-1, h, w)
    fallback = colours[free].mean(0) / 255 if free.any() else np.zeros(3)
    for image, mask, out in zip(colours, free, result, strict=True):
        small, known = image[::REDUCE, ::REDUCE].astype(np.float32) / 255, mask[::REDUCE, ::REDUCE].astype(np.float32)
        guess = np.broadcast_to(fallback, small.shape).astype(np.float32)
        for sigma in (64.0, 16.0, 4.0):
            weight = ndimage.gaussian_filter(known, sigma)[..., None]
            value = np.stack([ndimage.gaussian_filter(small[..., q] * known, sigma) for q in range(3)], -1)
            trust = np.clip(weight / 0.02, 0, 1)
            guess = trust * value / np.maximum(weight, 1e-6) + (1 - trust) * guess
        full = guess.repeat(REDUCE, 0).repeat(REDUCE, 1)[:h, :w]
        out[:] = np.where(mask[..., None], image / 255.0, full)
    return torch.from_numpy(result.reshape(len(colours), h * w, 3))
