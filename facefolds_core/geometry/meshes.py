"""Triangle meshes, as every stage passes them on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.geometry.track import Track


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

    def to_trimesh(self, texture: NDArray[np.uint8] | None = None) -> Any:
        """The mesh as a `trimesh.Trimesh`, with texture coordinates from the bottom left, as trimesh has them.

        Args:
            texture: (h, w, 4) RGBA, as `asset.frame(k)[layer]`; None leaves it out.
        """
        import trimesh

        uv = np.stack([self.st[:, 0], 1 - self.st[:, 1]], 1)
        image = None if texture is None else Image.fromarray(texture)
        visual: Any = trimesh.visual.TextureVisuals(uv=uv, image=image)  # type: ignore[no-untyped-call]
        return trimesh.Trimesh(self.vertices, self.faces, visual=visual, process=False)


def layers_at(layers: Sequence[TexturedMesh], track: Track | None, frame: float) -> Sequence[TexturedMesh]:
    """Layers in a frame, in their own axes: a torso stays in the room while the head turns."""
    if track is None or track.torso is None:
        return layers
    return [TexturedMesh(track.posed(one.vertices, frame).astype(np.float32), one.faces, one.st) for one in layers]
