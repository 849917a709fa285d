"""Front-to-back alpha compositing of layers, outermost first."""

from __future__ import annotations

import torch
from torch import Tensor


def compositing_weights(alpha: Tensor) -> tuple[Tensor, Tensor]:
    """w_i = alpha_i prod_{k<i} (1 - alpha_k), and what is left for the background.

    Finite in value and gradient for any alpha in [0, 1], 0 and 1 included.

    Args:
        alpha: [..., N] straight opacity, outermost first; 0 where a ray misses the layer.

    Returns:
        weights [..., N] and transmittance [...] = prod_k (1 - alpha_k); they add up to 1.
    """
    through = torch.cumprod(1 - alpha, -1)
    before = torch.cat([torch.ones_like(alpha[..., :1]), through[..., :-1]], -1)
    return alpha * before, through[..., -1]
