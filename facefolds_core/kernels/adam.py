"""Adam (Kingma and Ba 2015), compiled: the one step of all kernels, and what it is told of the two moments."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.kernels.jit import inlined

EPSILON = 1e-8
"""Against a division by zero, as in the paper."""

Betas = tuple[float, float]
"""Shares of the moments, of gradients and of their squares, that a step keeps."""


def decays(betas: Betas) -> NDArray[np.float32]:
    """(4,): what a step keeps of the first moment, what the gradient adds; the same of the second moment."""
    first, second = betas
    return np.array([first, 1 - first, second, 1 - second], np.float32)


def corrections(betas: Betas, steps: int) -> Betas:
    """Factors that take away the moments' bias towards 0, which they begin with."""
    first, second = betas
    return 1 / (1 - first**steps), 1 / (1 - second**steps)


@inlined
def adam(first: Any, second: Any, at: Any, g: Any, rate: Any, correct1: Any, correct2: Any, decay: Any) -> Any:
    """What a step takes from a value with gradient g.

    Args:
        first, second: moments, changed at the index `at`.
        correct1, correct2: of `corrections`; decay: of `decays`.
    """
    first[at] = decay[0] * first[at] + decay[1] * g
    second[at] = decay[2] * second[at] + decay[3] * g * g
    return rate * (first[at] * correct1) / (math.sqrt(second[at] * correct2) + np.float32(EPSILON))
