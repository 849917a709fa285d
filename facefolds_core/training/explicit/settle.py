"""Frames' colours in closed form: what steps leave over of a linear least squares.

While opacities are held a pixel's colour is linear in the texels' colours. A frame has few steps of its own, and each
moves a texel as far as the rate lets it; so detail as fine as a pixel, where skin moves, is never quite there.
"""

from __future__ import annotations

import numpy as np

from facefolds_core.training.explicit.follow import Light, summed_errors
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.views import Rays

ITERATIONS = 4
"""With 6 or 20 the scores are the same."""
RIDGE = 0.5
"""Rays' worth of what keeps a texel where it was."""


def settle_frame(state: TextureState, source: Rays, pictures: CutOuts, frame: int, light: Light) -> None:
    """Move what one frame adds to the colours, x (M, 3), to the least of sum |C - I|^2 + RIDGE |x - x_0|^2.

    Conjugate gradients (Hestenes, Stiefel 1952); the preconditioner is the sum of a texel's weights, which bounds the
    diagonal. C - I is linear in x where colours are within [0, 1]: a product with the matrix is a difference of two
    gradients.
    """
    x = state.frame_colour[0, frame].numpy()
    total = summed_errors(state, source, pictures, frame, light).astype(np.float64)
    gradient, scale = total[:, :3], 1 / (total[:, 3:] + RIDGE)
    rest = -gradient
    way = scale * rest
    size = float((rest * way).sum())
    for _ in range(ITERATIONS):
        if size <= 0:
            return
        here = x.copy()
        x += way.astype(np.float32)
        product = summed_errors(state, source, pictures, frame, light)[:, :3] - gradient
        x[:] = here
        pull = product + RIDGE * way
        far = size / float((way * pull).sum())
        x += (far * way).astype(np.float32)
        gradient, rest = gradient + far * product, rest - far * pull
        better = scale * rest
        size, before = float((rest * better).sum()), size
        way = better + size / before * way
