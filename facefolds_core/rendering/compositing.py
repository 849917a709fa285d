"""Front-to-back alpha compositing in numpy; in torch it is `model/compositing.py`. Kernels have it compiled in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def transmittance_before(alpha: NDArray[Any], axis: int) -> NDArray[Any]:
    """prod_{k<i} (1 - alpha_k) of each layer i along `axis`, outermost first; as `alpha` in shape and type."""
    first = np.ones_like(np.take(alpha, [0], axis))
    rest = np.cumprod(1 - alpha, axis)
    return np.concatenate([first, np.delete(rest, -1, axis)], axis)
