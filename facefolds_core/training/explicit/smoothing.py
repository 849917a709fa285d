"""Smoothing of opacity over neighbouring texels: the prior against opacity that only the training cameras see.

Some thirty cameras do not determine the opacity of each texel of twelve layers by itself: left alone it becomes grain
that shows each camera its own picture. `smooth` is compiled for CPUs, `smooth_reference` is plain torch.
"""

from __future__ import annotations

import numpy as np
import torch
from numba import prange
from torch import Tensor

from facefolds_core.jit import kernel


@kernel(parallel=True)
def smooth(values, height, width):  # type: ignore[no-untyped-def]
    """Mean over 3 x 3 texels, the outermost ones repeated beyond the border.

    Args:
        values: (height width, N) float32.

    Returns:
        the same of the means.
    """
    count = values.shape[1]
    out = np.empty_like(values)
    for i in prange(height):
        above, below = max(i - 1, 0) * width, min(i + 1, height - 1) * width
        rows = np.empty((width, count), np.float32)
        for j in range(width):
            for n in range(count):
                rows[j, n] = values[above + j, n] + values[i * width + j, n] + values[below + j, n]
        for j in range(width):
            left, right = max(j - 1, 0), min(j + 1, width - 1)
            for n in range(count):
                out[i * width + j, n] = (rows[left, n] + rows[j, n] + rows[right, n]) * np.float32(1 / 9)
    return out


def smooth_reference(values: Tensor, height: int, width: int) -> Tensor:
    """As `smooth`, of [height width, N]."""
    image = values.reshape(height, width, -1).permute(2, 0, 1)[None]
    padded = torch.nn.functional.pad(image, (1, 1, 1, 1), mode="replicate")
    return torch.nn.functional.avg_pool2d(padded, 3, 1)[0].permute(1, 2, 0).reshape(values.shape)
