"""Radius maps for tests, and what any must hold: the compiled search finds what the reference does."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.model.intersection import Crossings
from facefolds_core.model.radial import RadialManifolds


def layered(middle: Tensor, halfwidth: float, count: int) -> Tensor:
    """[rows, columns, count] radii, evenly spaced, that lie within a halfwidth of the middle."""
    return middle[..., None] + halfwidth * torch.linspace(1, -1, count)


def bumpy(chart: Chart, window: Window, radius: float, columns: int) -> RadialManifolds:
    generator = torch.Generator().manual_seed(0)
    coarse = torch.randn(1, 1, 6, 6, generator=generator)
    bumps = torch.nn.functional.interpolate(coarse, size=(48, columns), mode="bicubic")[0, 0]
    return RadialManifolds(chart, window, layered(radius + 0.01 * bumps, 0.01, 4))


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
