"""As `bake_kernel.accumulate` in plain torch, with gradients by autograd: what the kernel is tested against."""

from __future__ import annotations

import torch
from torch import Tensor

from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.model.compositing import compositing_weights, transmittances


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


def visible(rgba: Tensor, min_light: float) -> Tensor:
    """[P, N, 4] -> the same without what lies behind less light than `min_light`, which a step leaves out."""
    before, _ = transmittances(rgba[..., 3].detach())
    return torch.where((before >= min_light)[..., None], rgba, 0.0)


def composite(rgba: Tensor) -> Tensor:
    """[P, N, 4], outermost first -> [P, 4]: rgb over black, transmittance."""
    weights, transmittance = compositing_weights(rgba[..., 3])
    return torch.cat([(weights[..., None] * rgba[..., :3]).sum(1), transmittance[:, None]], -1)


def accumulate(codes: Tensor, target: Tensor, texture: Tensor, min_light: float) -> tuple[Tensor, Tensor]:
    """Sums [N, H, W, 6] as in the kernel, and the sum of |r|^2.

    Args:
        codes: [P, N, 2] int32.
        target: [P, 4].
        texture: [N, H, W, 4].
    """
    texture = texture.detach().requires_grad_()
    rgba = visible(look_up(codes, texture), min_light)
    residual = composite(rgba) - target
    (gradient,) = torch.autograd.grad(0.5 * residual.square().sum(), texture, retain_graph=True)
    # Derivatives of a ray's four numbers by its layers' rgb and alpha, then |J| times the row's sum, at the texels.
    alpha, behind = rgba[..., 3].detach(), torch.zeros_like(rgba[:, 0, :3])
    before, _ = transmittances(alpha)
    colour = before * alpha
    opacity, rest = torch.zeros_like(colour), torch.ones_like(alpha[:, 0])
    for n in reversed(range(alpha.shape[1])):
        change = (rgba[:, n, :3].detach() - behind).abs().amax(-1)
        opacity[:, n] = before[:, n] * torch.maximum(change, rest) * (alpha[:, n] > 0)
        rest = rest * (1 - alpha[:, n])
        behind = alpha[:, n, None] * rgba[:, n, :3].detach() + (1 - alpha[:, n, None]) * behind
    row = (colour + opacity).sum(-1, keepdim=True)
    taps = look_up(codes, texture)
    weights = torch.stack([colour * row, opacity * row], -1)
    (by_colour,) = torch.autograd.grad((taps[..., 0] * weights[..., 0]).sum(), texture, retain_graph=True)
    (by_opacity,) = torch.autograd.grad((taps[..., 3] * weights[..., 1]).sum(), texture)
    sums = torch.cat([gradient, by_colour[..., :1], by_opacity[..., 3:]], -1)
    return sums.detach(), residual.square().sum().detach()
