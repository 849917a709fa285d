"""The same as the compiled kernels of `training.explicit`, in plain torch: what they are tested against."""

from __future__ import annotations

import torch
from torch import Tensor

from facefolds_core.kernels.adam import EPSILON, Betas
from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.model.compositing import compositing_weights
from facefolds_core.training.explicit.shading_kernel import PRICE


def activate(colour: Tensor, layers: Tensor, frame_colour: Tensor, frame_alpha: Tensor) -> Tensor:
    """[M, 3], [M, N, 4], [M, 3], [M, N] -> [M, N, 4] rgb and alpha in [0, 1]."""
    rgb = ((colour + frame_colour)[:, None] + layers[..., :3]).clamp(0, 1)
    return torch.cat([rgb, torch.sigmoid(layers[..., 3] + frame_alpha)[..., None]], -1)


def look_up(codes: Tensor, texture: Tensor) -> Tensor:
    """Bilinear rgba [R, N, 4] at 16-bit positions [R, N, 2] (int32); alpha 0 where missed (code 0)."""
    height, width, layers, _ = texture.shape
    x = ((codes[..., 0] - 1) * (width / SCALE) - 0.5).clamp(0, width - 1)
    y = ((codes[..., 1] - 1) * (height / SCALE) - 0.5).clamp(0, height - 1)
    j, i = x.floor().clamp(max=width - 2).long(), y.floor().clamp(max=height - 2).long()
    b, a = (x - j)[..., None], (y - i)[..., None]
    flat = texture.reshape(-1, 4)

    def tap(di: int, dj: int) -> Tensor:
        n = torch.arange(layers, device=texture.device)
        return torch.nn.functional.embedding(((i + di) * width + j + dj) * layers + n, flat)

    rgba = (tap(0, 0) * (1 - b) + tap(0, 1) * b) * (1 - a) + (tap(1, 0) * (1 - b) + tap(1, 1) * b) * a
    hit = (codes[..., :1] > 0).to(rgba)
    return torch.cat([rgba[..., :3], rgba[..., 3:] * hit], -1)


def light_before(alpha: Tensor) -> Tensor:
    """prod_{k<i} (1 - alpha_k), [..., N]: what comes to each layer."""
    through = torch.cumprod(1 - alpha, -1)
    return torch.cat([torch.ones_like(alpha[..., :1]), through[..., :-1]], -1)


def visible(alpha: Tensor, min_alpha: float, min_light: float) -> Tensor:
    """[R, N] bool: layers with at least `min_alpha` of alpha that do not lie behind less light than `min_light`."""
    before = light_before(torch.where(alpha >= min_alpha, alpha, 0.0))
    return (alpha >= min_alpha) & (before >= min_light)


def shade(
    codes: Tensor,  # [R, N, 2] int32
    of: Tensor,  # [R], which of the P pixels a ray goes through
    cut: Tensor,  # [P, 4] in [0, 1], colours times opacity
    behind: Tensor,  # [P, 4], of the colours behind the mean, and their variances' sum
    texture: Tensor,  # [H, W, N, 4]
    shine: Tensor,  # [P, 3]
    min_alpha: float,
    min_light: float,
) -> tuple[Tensor, Tensor]:
    """As `shading_kernel.shade`: gradient [H, W, N, 4], sum of |C - I|^2."""
    texture = texture.detach().requires_grad_()
    with torch.enable_grad():
        rgba = look_up(codes, texture)
        alpha = torch.where(visible(rgba[..., 3].detach(), min_alpha, min_light), rgba[..., 3], 0.0)
        colour, transmittance = _pixels(rgba[..., :3] + shine[of][:, None], alpha, of, len(cut))
        mean, variance = behind[:, :3], behind[:, 3]
        squares = (colour + transmittance[:, None] * mean - over(cut, mean)).square().sum()
        squares = squares + (variance * (transmittance - 1 + cut[:, 3]).square()).sum()
        beside = ((1 - transmittance) * (cut[:, 3] == 0)).sum()
        (gradient,) = torch.autograd.grad(0.5 * squares + PRICE * beside, texture)
    return gradient, squares.detach()


def _pixels(rgb: Tensor, alpha: Tensor, of: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """Rays' [R, N, 3] and [R, N] -> colours over black [P, 3] and transmittances [P]: means of their rays."""
    weights, transmittance = compositing_weights(alpha)
    seen = torch.cat([(weights[..., None] * rgb).sum(1), transmittance[:, None]], 1)
    rays = torch.bincount(of, minlength=count).clamp(min=1)[:, None]
    means = seen.new_zeros(count, 4).index_add(0, of, seen) / rays
    return means[:, :3], means[:, 3]


def over(cut: Tensor, behind: Tensor) -> Tensor:
    """[R, 3]: cut-outs [R, 4], premultiplied, over colours [R, 3]."""
    return cut[:, :3] + (1 - cut[:, 3:]) * behind


def adam_step(
    colour: Tensor,  # [3, M, 3]: values, first and second moments; all updated in place
    layers: Tensor,  # [3, M, N, 4]
    frame_colour: Tensor,  # [3, M, 3]
    frame_alpha: Tensor,  # [3, M, N]
    texture: Tensor,  # [M, N, 4]
    gradient: Tensor,  # [M, N, 4]
    rates: Tensor,  # [5]
    correct: Tensor,  # [4]
    betas: Betas,
) -> None:
    """As `adam_kernel.adam_step`."""
    met = (gradient != 0).any(-1)
    alpha = texture[..., 3]
    slope = gradient[..., 3] * alpha * (1 - alpha)
    _adam(layers[..., :3], gradient[..., :3], met[..., None], rates[1], correct[:2], betas)
    _adam(layers[..., 3], slope, met, rates[2], correct[:2], betas)
    layers[0, ..., 3].clamp_(-9, 9)
    _adam(frame_alpha, slope, met, rates[4], correct[2:], betas)
    total, any_met = gradient[..., :3].sum(1), met.any(1, keepdim=True)
    _adam(colour, total, any_met, rates[0], correct[:2], betas)
    colour[0].clamp_(0, 1)
    _adam(frame_colour, total, any_met, rates[3], correct[2:], betas)


def _adam(state: Tensor, g: Tensor, met: Tensor, rate: Tensor, correct: Tensor, betas: Betas) -> None:
    values, first, second = state
    new_first = betas[0] * first + (1 - betas[0]) * g
    new_second = betas[1] * second + (1 - betas[1]) * g * g
    step = rate * (new_first * correct[0]) / ((new_second * correct[1]).sqrt() + EPSILON)
    values.copy_(torch.where(met, values - step, values))
    first.copy_(torch.where(met, new_first, first))
    second.copy_(torch.where(met, new_second, second))


def errors_by_texel(
    codes: Tensor, of: Tensor, cut: Tensor, behind: Tensor, texture: Tensor, shine: Tensor, min_light: float
) -> Tensor:
    """As `shading_kernel.shade` with `shares`: [H, W, N, 4], over the rays w (C - I) of their pixel, and w. Arguments
    as of `shade`."""
    texture = texture.detach().clone().requires_grad_()
    with torch.enable_grad():
        rgba = look_up(codes, texture)
        alpha = torch.where(visible(rgba[..., 3], 0.0, min_light), rgba[..., 3], 0.0).detach()
        colour, transmittance = _pixels(rgba[..., :3] + shine[of][:, None], alpha, of, len(cut))
        error = (colour + transmittance[:, None] * behind[:, :3] - over(cut, behind[:, :3])).detach()
        weights, _ = compositing_weights(alpha)
        # A colour's derivative is its weight.
        (errors,) = torch.autograd.grad(
            (weights[..., None] * rgba[..., :3] * error[of][:, None]).sum(), texture, retain_graph=True
        )
        (shares,) = torch.autograd.grad((weights * rgba[..., 0]).sum(), texture)
    return torch.cat([errors[..., :3], shares[..., :1]], -1)


def light_on(codes: Tensor, texture: Tensor, chosen: Tensor, min_light: float) -> Tensor:
    """As `follow_kernel.light_on`: [R, N, 2] int32, [H, W, N, 4], [H, W] bool -> [R]."""
    marked = chosen[..., None, None].to(texture).expand(texture.shape)
    before = light_before(look_up(codes, texture)[..., 3])
    met = (look_up(codes, marked)[..., 3] > 0) & (before >= min_light)
    return torch.where(met, before, 0.0).amax(1)
