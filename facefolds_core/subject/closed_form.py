"""Opacity along an outline, from the picture's colours: closed-form matting (Levin, Lischinski, Weiss 2008)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

Array = NDArray[np.float32]
Bool = NDArray[np.bool_]

SMOOTH = 1e-6
"""Variance of colours within 3 x 3 pixels that is nothing but noise, of values in [0, 1]."""
LEAST = 1e-6
"""Weight of the prior everywhere: a patch of one colour that touches nothing known is held by it alone."""


def closed_form(colours: Array, inside: Bool, unknown: Bool, prior: Array, weight: Array) -> Array:
    """(H, W) opacity in [0, 1]: the least of a^T L a + sum w (a - p)^2 in what is unknown; 1 on `inside`, 0 elsewhere.

    Args:
        colours: (H, W, 3) in [0, 1].
        inside, unknown: (H, W), apart.
        prior, weight: (H, W) p and w.
    """
    from pymatting import cf_laplacian  # compiles itself when it is first imported

    opacity = inside.astype(np.float64)
    if not unknown.any():
        return opacity.astype(np.float32)
    asked, told = np.flatnonzero(unknown), np.flatnonzero(inside)
    rows = cf_laplacian(colours.astype(np.float64), SMOOTH, 1, ~unknown).tocsr()[asked]
    w = np.maximum(weight.reshape(-1)[asked], LEAST).astype(np.float64)
    system = (rows[:, asked] + sparse.diags(w)).tocsc()
    right = w * prior.reshape(-1)[asked] - rows[:, told].sum(1).A1
    solved = splu(system, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(right)
    opacity.reshape(-1)[asked] = solved
    return np.clip(opacity, 0, 1).astype(np.float32)
