"""Adam on Gaussians, compiled."""

# numba has no types:
# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import prange

from facefolds_core.kernels.adam import adam
from facefolds_core.kernels.jit import kernel


@kernel(parallel=True)
def adam_step(values, first, second, gradient, seen, rates, correct, decay):
    """A step of the Gaussians that were seen; the others stay as they are, moments included.

    Args:
        values, first, second: (N, COLUMNS) float32, in place.
        gradient: (N, COLUMNS) float32.
        seen: (N,) bool.
        rates: (COLUMNS,) float32; those of the position are for a Gaussian within 1 unit of the origin.
        correct, decay: of `adam.corrections` and `adam.decays`, float32.
    """
    for n in prange(values.shape[0]):
        if not seen[n]:
            continue
        far = math.sqrt(values[n, 0] ** 2 + values[n, 1] ** 2 + values[n, 2] ** 2)
        for k in range(values.shape[1]):
            rate = rates[k] * max(far, np.float32(1)) if k < 3 else rates[k]
            values[n, k] -= adam(first, second, (n, k), gradient[n, k], rate, correct[0], correct[1], decay)
        for k in range(11, 14):
            values[n, k] = min(max(values[n, k], np.float32(0)), np.float32(1))
