"""Small loose patches of opacity: rests of the room, or of the subject where a single camera saw it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

OPACITY = 0.3
"""Patches of texels that are more opaque, in any frame, are compared by size."""

LEAST_SHARE = 0.02
"""Of the largest patch: smaller ones go."""

REACH = 3
"""Width of the soft edge around patches that stay, texels."""


def loose(opacity: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Where nothing is near a large patch of opacity: from another side such places are splinters in the air, or fog.

    Args:
        opacity: (H, W) of all layers together, the most over all frames.

    Returns:
        (H, W) bool; nowhere if there is no opacity at all.
    """
    labels, count = ndimage.label(opacity > OPACITY, np.ones((3, 3)))
    if not count:
        return np.zeros(opacity.shape, bool)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    large = sizes >= LEAST_SHARE * sizes.max()
    return np.asarray(~ndimage.maximum_filter(large[labels], 2 * REACH + 1))
