"""Smoothing of opacity over neighbouring texels: the prior against opacity that only the training cameras see.

Some thirty cameras do not determine the opacity of each texel of twelve layers by itself: left alone it becomes grain
that shows each camera its own picture. `smooth` is compiled for CPUs, `smooth_reference` is plain torch.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numba import prange
from torch import Tensor

from facefolds_core.kernels.jit import inlined, kernel


@kernel(parallel=True)
def smooth(values, height, width):  # type: ignore[no-untyped-def]
    """Mean over 3 x 3 texels, the outermost ones repeated beyond the border.

    Args:
        values: (height width, N) float32.

    Returns:
        the same of the means.
    """
    out = np.empty_like(values)
    for i in prange(height):
        rows = np.empty((width, values.shape[1]), np.float32)
        for j in range(width):
            column_sum(i, j, values, height, width, rows[j])
        for j in range(width):
            left, right = rows[max(j - 1, 0)], rows[min(j + 1, width - 1)]
            mean(left, rows[j], right, out[i * width + j])
    return out


@inlined
def column_sum(i: Any, j: Any, values: Any, height: Any, width: Any, out: Any) -> None:
    """out (N,): sum over texel (i, j), the one above, and the one below."""
    above, below = max(i - 1, 0) * width + j, min(i + 1, height - 1) * width + j
    for n in range(values.shape[1]):
        out[n] = values[above, n] + values[i * width + j, n] + values[below, n]


@inlined
def mean(left: Any, middle: Any, right: Any, out: Any) -> None:
    """out (N,): mean of nine texels of which the sums of threes are given."""
    for n in range(out.shape[0]):
        out[n] = (left[n] + middle[n] + right[n]) * np.float32(1 / 9)


def smooth_reference(values: Tensor, height: int, width: int) -> Tensor:
    """As `smooth`, of [height width, N]."""
    image = values.reshape(height, width, -1).permute(2, 0, 1)[None]
    padded = torch.nn.functional.pad(image, (1, 1, 1, 1), mode="replicate")
    return torch.nn.functional.avg_pool2d(padded, 3, 1)[0].permute(1, 2, 0).reshape(values.shape)
