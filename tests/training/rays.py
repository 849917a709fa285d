"""Rays for tests of what is trained on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.training.explicit.views import FINER, Views


def one_each(codes: NDArray[np.uint16], directions: NDArray[np.float32] | None = None) -> Views:
    """Of the first camera's pixels, one ray each, with codes (P, N, 2)."""
    count = len(codes)
    numbers = np.arange(count, dtype=np.int32)
    directions = np.zeros((count, 3), np.float32) if directions is None else directions
    finer, which = np.zeros((0, len(FINER), *codes.shape[1:]), np.uint16), np.full(count, -1, np.int32)
    return Views(codes, finer, which, 0 * numbers, numbers, directions)
