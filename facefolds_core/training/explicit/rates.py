"""How fast which textures follow the pictures: Adam's numbers, and factors on `textures.learning_rate`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FINAL_RATE = 0.1
"""To this part of itself every rate falls along the last level: the noise of single steps settles."""

BETAS = (0.9, 0.99)
"""Adam's beta 1 and beta 2: shares of the moments that a step keeps. The second is lower than the usual 0.999: a level
has some hundred steps, and a texel is met in few of them."""

LAYER_RATE = 0.3
"""Of the layers' own colours: they are small changes."""

ALPHA_RATE = 15.0
"""Of the logits of alpha: logits move over eighteen units, colours over one."""

FRAME_RATE = 0.5
"""Of the frames' parts, against those of what is shared."""


def falling(progress: float) -> float:
    """Factor on all rates where they fall, from 1 at the start to `FINAL_RATE` at the end."""
    return 1 - (1 - FINAL_RATE) * progress


def rates_of(rate: float) -> NDArray[np.float32]:
    """(5,) of shared colours, the layers' colours, logits of alpha, and a frame's colours and logits."""
    factors = np.array([1, LAYER_RATE, ALPHA_RATE, FRAME_RATE, FRAME_RATE * ALPHA_RATE])
    return (rate * factors).astype(np.float32)
