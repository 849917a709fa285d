"""What the compiled Adam steps are told of its two moments (Kingma and Ba 2015)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
