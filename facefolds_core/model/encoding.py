"""Positional encoding."""

from __future__ import annotations

import math

import torch
from torch import Tensor


def positional_encoding(x: Tensor, octaves: int) -> Tensor:
    """NeRF's encoding with the input itself in front: (x, sin(2^k pi x), cos(2^k pi x)) for k = 0 .. octaves - 1.

    The paper says "positional encodings" only; this is the form of Mildenhall et al. 2020, eq. 4, with the raw input
    kept, as their code does.

    Args:
        x: [..., D], meant for values in [-1, 1].
        octaves: L; 0 returns x.

    Returns:
        [..., D (1 + 2 L)].
    """
    if octaves == 0:
        return x
    frequencies = math.pi * 2.0 ** torch.arange(octaves, dtype=x.dtype, device=x.device)
    phase = (x[..., None] * frequencies).flatten(-2)
    return torch.cat([x, phase.sin(), phase.cos()], -1)


def encoded_size(dimensions: int, octaves: int) -> int:
    """Length of `positional_encoding` of a vector of `dimensions`."""
    return dimensions * (1 + 2 * octaves)
