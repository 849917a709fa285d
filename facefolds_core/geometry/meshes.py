"""Triangle meshes, as every stage passes them on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Surface:
    """A triangle mesh.

    Attributes:
        vertices: (V, 3) float32, normalised world.
        faces: (F, 3) int32, counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]


@dataclass(frozen=True)
class TexturedMesh(Surface):
    """A triangle mesh with texture coordinates: one layer of an asset.

    Attributes:
        st: (V, 2) float32 in [0, 1], layer-local: s right, t down from the texture's top left corner.
    """

    st: NDArray[np.float32]
