"""A closed-form model for the export tests: nested ellipsoids around c with smooth textures in (u, v) and time.

It offers what the export asks of `RadianceManifolds`. An ellipsoid around c with semi-axes a, b, d is
met in the direction n at the radius 1 / |(n_x / a, n_y / b, n_z / d)|. Only the front half (n_x > 0) exists.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import torch
from torch import Tensor

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import FULL_WINDOW, Window, points_to_uv, uv_to_directions

CHART = Chart(SPHERE_CENTRE)


@dataclass(frozen=True)
class Crossed:
    points: Tensor
    hit: Tensor


@dataclass(frozen=True)
class Composited:
    rgb: Tensor
    alpha: Tensor
    weights: Tensor


@dataclass(frozen=True)
class Ellipsoids:
    """N ellipsoids, outermost first.

    Attributes:
        axes: (N, 3) semi-axes, units.
        patch: alpha fades to 0 at this distance of (u, v) from (0, 0).
        hole: no surface within this distance of (u, v) = (0.2, 0.2); 0 for none.
        num_frames: K.
    """

    axes: tuple[tuple[float, float, float], ...] = ((0.36, 0.30, 0.38), (0.33, 0.27, 0.35))
    patch: float = 10.0
    hole: float = 0.0
    num_frames: int = 2
    centre: Tensor = field(default_factory=lambda: torch.tensor(SPHERE_CENTRE, dtype=torch.float64))

    chart: Chart = CHART
    window: Window = FULL_WINDOW

    @property
    def num_layers(self) -> int:
        return len(self.axes)

    def texel_grid(self) -> None:
        """None: it has no texels."""
        return None

    def surface_points(self, uv: Tensor) -> tuple[Tensor, Tensor]:
        n = uv_to_directions(uv)
        radius = torch.stack([1 / (n / torch.tensor(a, dtype=n.dtype)).norm(dim=-1) for a in self.axes])
        valid = ((uv - 0.2).norm(dim=-1) >= self.hole).expand(self.num_layers, -1)
        return self.centre + radius[..., None] * n, valid

    def reflection_maps(self) -> None:
        return None

    def crossings(self, origins: Tensor, directions: Tensor) -> Crossed:
        points, hits = [], []
        for axes in self.axes:
            scale = torch.tensor(axes, dtype=origins.dtype)
            o, d = (origins - self.centre) / scale, directions / scale
            a, b, c = (d * d).sum(-1), (o * d).sum(-1), (o * o).sum(-1) - 1
            discriminant = b * b - a * c
            distance = (-b - discriminant.clamp(min=0).sqrt()) / a
            point = origins + distance[:, None] * directions
            points.append(point)
            hits.append((discriminant > 0) & (distance > 0) & (point[:, 0] > self.centre[0]))
        return Crossed(torch.stack(points, 1), torch.stack(hits, 1))

    def texture(self, uv: Tensor, layer: int, time: float) -> tuple[Tensor, Tensor]:
        u, v = uv[:, 0] * math.pi * (3 + layer), uv[:, 1] * math.pi * (3 + layer)
        rgb = 0.5 + 0.4 * torch.stack([torch.sin(v + time), torch.sin(u - v + 1), torch.sin(u + 2 + time)], -1)
        alpha = torch.full_like(u, 1.0) if layer == self.num_layers - 1 else 0.5 + 0.3 * torch.sin(u + v)
        return rgb, alpha * ((self.patch**2 - (uv**2).sum(-1)) / (0.5 * self.patch**2)).clamp(0, 1)

    def render(self, origins: Tensor, directions: Tensor, time: float, view_effects: bool) -> Composited:
        crossed = self.crossings(origins, directions)
        rgb, through, weights = torch.zeros_like(origins), torch.ones_like(origins[:, 0]), []
        for layer in range(self.num_layers):
            uv, _ = points_to_uv(crossed.points[:, layer], self.centre)
            colour, alpha = self.texture(uv, layer, time)
            alpha = alpha * crossed.hit[:, layer]
            weights.append(through * alpha)
            rgb = rgb + weights[-1][:, None] * colour
            through = through * (1 - alpha)
        return Composited(rgb, 1 - through, torch.stack(weights, -1))
