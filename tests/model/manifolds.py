"""Bumpy radius maps, and what any must hold: the compiled search finds what the reference does, and its gradient."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.model.intersection import Crossings
from facefolds_core.model.radial import RadialManifolds


def bumpy(chart: Chart, window: Window, radius: float, columns: int) -> RadialManifolds:
    generator = torch.Generator().manual_seed(0)
    coarse = torch.randn(1, 1, 6, 6, generator=generator)
    bumps = torch.nn.functional.interpolate(coarse, size=(48, columns), mode="bicubic")[0, 0]
    return RadialManifolds(chart, window, radius + 0.01 * bumps, torch.full((48, columns), 0.01), 4)


def check_compiled(manifolds: RadialManifolds, origins: Tensor, directions: Tensor, share: float) -> Crossings:
    """What the compiled search finds, but for a few rays as the reference; both hit the same at `share` of all."""
    with torch.no_grad():
        compiled = manifolds.crossings(origins, directions)
        reference = manifolds.reference_crossings(origins, directions)
    # A grazing ray may touch a bump between the samples of one search and not of the other.
    assert (compiled.hit == reference.hit).float().mean() > share
    both = compiled.hit & reference.hit
    error = (compiled.distance - reference.distance)[both].abs()
    assert (error < 1e-4).float().mean() > 0.995  # worst of the rest: another crossing of the same bump
    assert error.median() < 1e-6
    return replace(compiled, hit=both)


def check_gradient(manifolds: RadialManifolds, origins: Tensor, directions: Tensor) -> Crossings:
    """What is found; the gradient of the distances of hits is that of finite differences."""
    crossings = manifolds.crossings(origins, directions)
    weights = torch.linspace(-1, 1, crossings.distance.numel()).view_as(crossings.distance) * crossings.hit
    (crossings.distance * weights).sum().backward()
    step = torch.cos(torch.arange(manifolds.middle.numel()).float()).view_as(manifolds.middle)
    values = []
    for sign in (1, -1):
        middle = manifolds.middle.detach() + sign * 2e-4 * step
        moved = RadialManifolds(manifolds.chart, manifolds.window, middle, manifolds.halfwidth, 4)
        with torch.no_grad():
            values.append(float((moved.reference_crossings(origins, directions).distance * weights).sum()))
    assert float((manifolds.middle.grad * step).sum()) == pytest.approx((values[0] - values[1]) / 4e-4, rel=0.03)
    return crossings
