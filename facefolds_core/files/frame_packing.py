"""Images packed without loss, as differences from the image before: what a frame store keeps of textures.

Textures of neighbouring frames differ little, those that `bake` holds hardly at all.
"""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

Image = NDArray[np.uint8]

PACKING = "zstd"
"""Of packed files, in their metadata."""

RUN = 12
"""Images that hang together, at most: who looks at a single one unpacks so many."""


def unpacked(data: pa.Buffer, shape: tuple[int, int, int], before: Image | None) -> Image:
    """The image of what `Packer` made of it.

    Args:
        before: the image that it is the difference from, None if it stands alone.

    Raises:
        ValueError, ArrowException: if the data are damaged.
    """
    flat = pa.decompress(data, shape[0] * shape[1] * shape[2], PACKING)
    difference = np.frombuffer(flat, np.uint8).reshape(shape)
    if before is None:
        return np.cumsum(difference, axis=1, dtype=np.uint8)
    return np.asarray(before + difference, np.uint8)


class Packer:
    """Packs the images of any number of indices (layers), each in the order of its frames."""

    def __init__(self) -> None:
        self._last: dict[int, tuple[int, Image]] = {}
        self._run: dict[int, int] = {}

    def pack(self, index: int, frame: int, image: Image) -> tuple[int, bytes]:
        """The frame whose image it is the difference from, or -1; and the packed difference."""
        after, before = self._last.get(index, (-1, image))
        self._run[index] = run = (self._run.get(index, 0) + 1) % RUN if 0 <= after < frame else 0
        if run == 0:
            after, difference = -1, image.copy()
            difference[:, 1:] -= image[:, :-1]  # wraps around, as the sum does
        else:
            difference = image - before
        self._last[index] = (frame, image.copy())
        packed: bytes = pa.compress(np.ascontiguousarray(difference).data, PACKING, asbytes=True)
        return after, packed
