"""The same as the outer zone's compiled kernel, in plain torch: what it is tested against."""

from __future__ import annotations

import torch
from torch import Tensor

from facefolds_core.model.compositing import compositing_weights
from facefolds_core.training.volume.reference import sample


def contract(points: Tensor) -> Tensor:
    """Points [..., 3] in radii of the ball -> the ball of radius 2 (Barron et al. 2022, mip-NeRF 360, eq. 10)."""
    n = points.norm(dim=-1, keepdim=True).clamp(min=1)
    contracted: Tensor = (2 - 1 / n) * points / n
    return contracted


def look(
    origins: Tensor,  # [R, 3]
    directions: Tensor,  # [R, 3]
    jitter: Tensor,  # [R]
    grid: Tensor,  # [M, M, M, 4]
    radius: float,
    step: float,
    farthest: float,
    samples: int,
) -> tuple[Tensor, Tensor]:
    """As `room_kernel.look`, differentiable in the grid: rgb over black [R, 3], transmittance [R]."""
    nearest = -(origins * directions).sum(-1)
    inside = nearest.square() - origins.square().sum(-1) + radius**2
    s = (nearest + inside.clamp(min=0).sqrt()).clamp(min=0)
    voxel = 4 / (grid.shape[0] - 1)
    rgba, alive = [], []
    for _ in range(samples):
        y = (origins + s[:, None] * directions) / radius
        n = y.norm(dim=-1).clamp(min=1)
        cosine = (y * directions).sum(-1) / n
        across = (1 - cosine.square()).clamp(min=0)
        stride = step * radius * n.square() / (cosine.square() + across * (2 * n - 1).square()).sqrt()
        point = (origins + (s + jitter * stride)[:, None] * directions) / radius
        rgba.append(sample(grid, contract(point), torch.full((3,), -2.0, dtype=grid.dtype), voxel))
        alive.append(n < farthest)
        s = torch.where(n < farthest, s + stride, s)
    values, near = torch.stack(rgba, 1), torch.stack(alive, 1)
    alpha = 1 - torch.exp(-torch.nn.functional.softplus(values[..., 0]) * step / voxel)
    weights, through = compositing_weights(torch.where(near, alpha, 0.0))
    return (weights[..., None] * values[..., 1:]).sum(1), through
