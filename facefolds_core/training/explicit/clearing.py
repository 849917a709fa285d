"""Texels that the finished model does without: what no ray shows, what lies beside the subject, splinters."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.facts import Fact, fact
from facefolds_core.params import PruningParams
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.views import Rays

BESIDE_OPACITY = 0.3
"""Directions in which the subject's Gaussians are less opaque lie beside it and become transparent."""

SPECK_OPACITY = 0.3
"""Patches of texels that are more opaque, in any frame, are compared by size."""

SPECK_REACH = 3
"""Width of the soft edge around patches that stay, texels."""


def clear_texels(state: TextureState, rays: Rays, passes: int, params: PruningParams) -> list[Fact]:
    """Make them transparent; what is to be said of it.

    Args:
        rays: of the training cameras, looked at in `passes` parts.
    """
    least, found = params.texel_opacity, list[Fact]()
    hidden = state.contributions(rays, passes) < least
    hidden |= state.beside(BESIDE_OPACITY)
    state.hide(hidden)
    apart, count = specks(_opacity(state), params.speck_share)
    if count:
        splinters = torch.from_numpy(apart.reshape(-1, 1))
        state.hide(splinters.expand_as(hidden))
        hidden |= splinters
        found.append(fact("specks_cleared", count=count, share=params.speck_share))
    found.append(fact("texels_cleared", share=float(hidden.float().mean()), least=least))
    return found


def _opacity(state: TextureState) -> NDArray[np.float32]:
    """(H, W) of all layers together, the most over all frames."""
    clear = [(1 - state.activated(k)[..., 3]).prod(1) for k in range(len(state.steps))]
    opacity: NDArray[np.float32] = 1 - torch.stack(clear).amin(0).view(*state.shape).numpy()
    return opacity


def specks(opacity: NDArray[np.floating], share: float) -> tuple[NDArray[np.bool_], int]:
    """Where nothing is near a large patch of opacity, and how many small patches lie there.

    Layers over one window of directions can show what floats apart from the head: rests of the room, or of the subject
    where a single camera saw it. From another side they are splinters in the air.

    Args:
        opacity: (H, W) of all layers together, the most over all frames.
        share: of the largest patch, below which one is small.

    Returns:
        (H, W) bool; nowhere, and 0, where there is no opacity at all or `share` is 0.
    """
    labels, count = ndimage.label(opacity > SPECK_OPACITY, np.ones((3, 3)))
    if count < 2 or share == 0:
        return np.zeros(opacity.shape, bool), 0
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    large = sizes >= share * sizes.max()
    reach = 2 * SPECK_REACH + 1
    near = ndimage.maximum_filter(large[labels], reach)
    return ~near, int(count - large.sum())
