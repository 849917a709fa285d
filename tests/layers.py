"""Radius maps of layers that stand evenly about a middle."""

from __future__ import annotations

import torch
from torch import Tensor


def evenly(middle: Tensor, halfwidth: float, layers: int) -> Tensor:
    """[rows, columns, N] radii, outermost first, within `halfwidth` of the middle [rows, columns]."""
    return middle[..., None] + halfwidth * (torch.linspace(1, -1, layers) if layers > 1 else torch.zeros(1))
