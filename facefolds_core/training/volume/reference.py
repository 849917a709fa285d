"""The same as the compiled kernel, in plain torch: what it is tested against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.geometry.cameras import Camera
from facefolds_core.model.compositing import compositing_weights, transmittances
from facefolds_core.training.volume.look_kernel import CLEAR, OPAQUE


def sample(grid: Tensor, points: Tensor, lower: Tensor, voxel: float) -> Tensor:
    """Trilinear values [..., 4] of grid [X, Y, Z, 4] at points [..., 3]; clamped to its box."""
    size = torch.tensor(grid.shape[:3], device=grid.device)
    at = torch.minimum(((points - lower) / voxel).clamp(min=0), size - 1)
    corner = torch.minimum(at.floor().long(), size - 2)
    fraction = at - corner
    out = torch.zeros(*points.shape[:-1], grid.shape[-1], dtype=grid.dtype, device=grid.device)
    for tap in range(8):
        offset = torch.tensor([tap >> 2, (tap >> 1) & 1, tap & 1], device=grid.device)
        weight = torch.where(offset.bool(), fraction, 1 - fraction).prod(-1, keepdim=True)
        i, j, k = (corner + offset).unbind(-1)
        out = out + weight * grid[i, j, k]
    return out


def shade(
    origins: Tensor,  # [R, 3]
    directions: Tensor,  # [R, 3]
    jitter: Tensor,  # [R]
    target: Tensor,  # [R, 3]
    background: Tensor,  # [R, 3]
    matte: Tensor,  # [R], -1 where it is not known
    grid: Tensor,  # [X, Y, Z, 4]
    lower: Tensor,  # [3]
    voxel: float,
    step: float,
    opacity_weight: float,
    binarisation_weight: float,
    matte_weight: float,
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """As `kernel.shade` with all blocks occupied.

    Returns:
        gradient [X, Y, Z, 4], residual [R, 3], transmittance [R], sum of |C - I|^2.
    """
    grid = grid.detach().requires_grad_()
    upper = lower + voxel * (torch.tensor(grid.shape[:3]) - 1)
    ends = torch.stack([(lower - origins) / directions, (upper - origins) / directions])
    near = ends.amin(0).amax(-1).clamp(min=0)
    far = ends.amax(0).amin(-1)
    count = int(((far - near).max() / step).ceil()) + 1
    s = near[:, None] + (jitter[:, None] + torch.arange(count)) * step
    rgba = sample(grid, origins[:, None] + s[..., None] * directions[:, None], lower, voxel)
    alpha = 1 - torch.exp(-torch.nn.functional.softplus(rgba[..., 0]) * step / voxel)
    alpha = torch.where((s < far[:, None]) & (alpha >= CLEAR), alpha, 0.0)
    before, _ = transmittances(alpha.detach())
    alpha = torch.where(before >= OPAQUE, alpha, 0.0)
    weights, transmittance = compositing_weights(alpha)
    residual = (weights[..., None] * rgba[..., 1:]).sum(1) + transmittance[:, None] * background - target
    squares = residual.square().sum()
    nearly = transmittance.clamp(max=0.5)
    loss = 0.5 * squares + (opacity_weight * (1 - transmittance) + binarisation_weight * nearly * (1 - nearly)).sum()
    loss = loss + 0.5 * matte_weight * (1 - transmittance - matte)[matte >= 0].square().sum()
    (gradient,) = torch.autograd.grad(loss, grid)
    return gradient, residual.detach(), transmittance.detach(), squares.detach()


def seen_share(cameras: Sequence[Camera], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """As `sight.seen_share`."""
    count = np.zeros(len(points))
    for camera in cameras:
        at = (points @ camera.rotation.T + camera.w2c[:, 3]) @ camera.K.T
        pixel = at[:, :2] / np.maximum(at[:, 2:], 1e-9)
        inside = (pixel >= 0).all(1) & (pixel[:, 0] < camera.width) & (pixel[:, 1] < camera.height)
        count += inside & (at[:, 2] > 0)
    return count / len(cameras)
