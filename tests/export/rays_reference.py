"""What rays see whose hits are kept as codes, in plain torch."""

from __future__ import annotations

import torch
from torch import Tensor

from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.model.compositing import compositing_weights


def look_up(codes: Tensor, texture: Tensor) -> Tensor:
    """Bilinear rgba [P, N, 4] of textures [N, H, W, 4] at 16-bit coordinates [P, N, 2] (int32); 0 where missed."""
    layers, height, width, _ = texture.shape
    x = ((codes[..., 0] - 1) * (width / SCALE) - 0.5).clamp(0, width - 1)
    y = ((codes[..., 1] - 1) * (height / SCALE) - 0.5).clamp(0, height - 1)
    j, i = x.floor().clamp(max=width - 2).long(), y.floor().clamp(max=height - 2).long()
    b, a = (x - j)[..., None], (y - i)[..., None]
    n = torch.arange(layers, device=texture.device)
    top = texture[n, i, j] * (1 - b) + texture[n, i, j + 1] * b
    bottom = texture[n, i + 1, j] * (1 - b) + texture[n, i + 1, j + 1] * b
    return (top * (1 - a) + bottom * a) * (codes[..., :1] > 0)


def composite(rgba: Tensor) -> Tensor:
    """[P, N, 4], outermost first -> [P, 4]: rgb over black, transmittance."""
    weights, transmittance = compositing_weights(rgba[..., 3])
    return torch.cat([(weights[..., None] * rgba[..., :3]).sum(1), transmittance[:, None]], -1)
