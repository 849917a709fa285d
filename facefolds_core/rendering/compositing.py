"""Front-to-back alpha compositing in numpy; in torch it is `model/compositing.py`. Kernels have it compiled in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class FrontToBack:
    """What is left of the light of many pixels, while layers are put before it, outermost first.

    Attributes:
        transmittance: prod_k (1 - alpha_k) of the layers so far, float32.
    """

    def __init__(self, shape: int | tuple[int, ...]) -> None:
        self.transmittance = np.ones(shape, np.float32)

    def add(self, hit: NDArray[Any], alpha: NDArray[np.float32]) -> NDArray[np.float32]:
        """Put a layer behind those so far: the weights alpha_i prod_{k<i} (1 - alpha_k) of the pixels that it covers.

        Args:
            hit: a mask, or the indices, of M pixels.
            alpha: (M,) of the layer there.
        """
        before = self.transmittance[hit]
        self.transmittance[hit] = before * (1 - alpha)
        return np.asarray(before * alpha)


def transmittance_before(alpha: NDArray[Any], axis: int) -> NDArray[Any]:
    """prod_{k<i} (1 - alpha_k) of each layer i along `axis`, outermost first; as `alpha` in shape and type."""
    first = np.ones_like(np.take(alpha, [0], axis))
    rest = np.cumprod(1 - alpha, axis)
    return np.concatenate([first, np.delete(rest, -1, axis)], axis)
