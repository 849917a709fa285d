"""What the kernels compute, readable: torch, pixel by pixel over all Gaussians; autograd gives the gradients."""

from __future__ import annotations

import torch
from torch import Tensor

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.blend_kernel import DARK, SOLID
from facefolds_core.subject.project_kernel import BLUR, FAINT, NEAR, WIDE


def rotation(quaternion: Tensor) -> Tensor:
    """(N, 4) of any length, w first -> (N, 3, 3)."""
    w, x, y, z = (quaternion / quaternion.norm(dim=1, keepdim=True)).unbind(1)
    rows = [
        torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], 1),
        torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], 1),
        torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1),
    ]
    return torch.stack(rows, 1)


def project(values: Tensor, camera: Camera) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
    """Gaussians (N, COLUMNS) in a picture: means (N, 2), covariances (N, 2, 2), pixels; opacities (N,), RGB (N, 3),
    depths (N,)."""
    K, R = (torch.as_tensor(part, dtype=values.dtype) for part in (camera.K, camera.rotation))
    translation = torch.as_tensor(camera.w2c[:, 3], dtype=values.dtype)
    centre = torch.as_tensor(camera.centre, dtype=values.dtype)
    x, y, z = (values[:, :3] @ R.T + translation).unbind(1)
    fx, fy, skew = K[0, 0], K[1, 1], K[0, 1]
    mean = torch.stack([(fx * x + skew * y) / z + K[0, 2], fy * y / z + K[1, 2]], 1)
    far_x, far_y = WIDE * camera.width / 2 / fx * z, WIDE * camera.height / 2 / fy * z
    x, y = torch.minimum(torch.maximum(x, -far_x), far_x), torch.minimum(torch.maximum(y, -far_y), far_y)
    none = torch.zeros_like(z)
    first = torch.stack([fx / z, skew / z + none, -(fx * x + skew * y) / z**2], 1)
    second = torch.stack([none, fy / z, -fy * y / z**2], 1)
    spread = torch.stack([first, second], 1) @ R @ rotation(values[:, 6:10]) * values[:, 3:6].exp()[:, None]
    covariance = spread @ spread.transpose(1, 2) + BLUR * torch.eye(2, dtype=values.dtype)
    direction = values[:, :3].detach() - centre
    direction = direction / direction.norm(dim=1, keepdim=True)
    shine = (values[:, 14:23].reshape(-1, 3, 3) * direction[..., None]).sum(1)
    return mean, covariance, torch.sigmoid(values[:, 10]), values[:, 11:14] + shine, z


def draw(values: Tensor, camera: Camera) -> tuple[Tensor, Tensor]:
    """RGB over black (H, W, 3) and transmittance (H, W)."""
    mean, covariance, opacity, rgb, depth = project(values, camera)
    pixels = torch.as_tensor(camera.pixel_centres(), dtype=values.dtype)
    picture, light = torch.zeros_like(pixels[..., :1]).repeat(1, 1, 3), torch.ones_like(pixels[..., 0])
    for n in torch.argsort(depth.detach(), stable=True).tolist():
        if depth[n] <= NEAR:
            continue
        offset = pixels - mean[n]
        p = 0.5 * ((offset @ torch.linalg.inv(covariance[n])) * offset).sum(-1)
        alpha = opacity[n] * torch.exp(-p)
        alpha = torch.where(alpha < FAINT, 0.0, alpha.clamp(max=SOLID))
        weight = torch.where(light < DARK, 0.0, alpha * light)
        picture = picture + weight[..., None] * rgb[n]
        light = light - weight
    return picture, light
