"""Where a ray meets a layer, in 16 bits a coordinate: what the fits of textures keep of all pixels of all cameras.

`codes` (P, N, 2) uint16 are 1 + SCALE s and 1 + SCALE t of the hit of each of P rays with each of N layers; 0 where a
ray misses the layer. A picture's hits in full are `rendering.Hits`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.kernels.jit import inlined

SCALE = 65534.0


def encode(st: NDArray[Any]) -> NDArray[Any]:
    """Codes of texture coordinates, beyond [0, 1] those of its ends; to be stored as uint16."""
    return np.rint(1 + SCALE * st.clip(0, 1))


@inlined
def corner(code, size):  # type: ignore[no-untyped-def]
    """Code -> index of the texel before it along a side of `size`, and the fraction beyond its centre; clamped."""
    x = min(max((code - 1) * (size / SCALE) - 0.5, 0.0), size - 1.0)
    i = min(int(x), size - 2)
    return i, np.float32(x - i)


def before(codes: NDArray[np.uint16], size: int) -> NDArray[np.int64]:
    """The indices of `corner`, of an array; any for misses."""
    x = np.clip((codes.astype(np.float64) - 1) * (size / SCALE) - 0.5, 0, size - 1)
    return np.minimum(x.astype(np.int64), size - 2)
