"""What a training step is compared with: photos, or the subject alone over a colour that changes from step to step.

Where the subject's opacity m is known in every training picture, its own colours F are, too: F = I - (1 - m) B before a
plate B, else `foreground` estimates them. Layers are then compared with F + (1 - m) g over any colour g, a new one for
each camera in each step: |C + T g - F - (1 - m) g|^2 asks for the right colour and for the right opacity at once,
inside, at the outline and outside. What stands behind need not be learnt, and nothing can be painted with it.
"""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
import torch
from numba import prange
from numpy.typing import NDArray

from facefolds_core.captures.cutout import foreground
from facefolds_core.captures.scene import Scene
from facefolds_core.frame_store import FrameStore
from facefolds_core.jit import kernel
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.views import Images, OneFrame, Pictures

KEPT_BYTES = 2 << 30
"""Of cut-outs that are kept in memory; others are made again when their frame's turn comes."""


def all_mattes(scene: Scene) -> bool:
    """Whether the subject's opacity is known in every training picture."""
    mattes, photos = scene.open_mattes(), scene.open_frames()
    training = set(scene.indices("train"))
    return mattes is not None and all(key in mattes for key in photos if key[0] in training)


class CutOuts(Images):
    """The subject of the training pictures, over the colours that `shuffle` draws.

    Args:
        scene: with mattes of all training pictures.
        gains: as of `Images`.

    Attributes:
        behind: (C, 3) float32, of each camera.
    """

    changes = True

    def __init__(self, scene: Scene, gains: NDArray[np.float64] | None = None) -> None:
        super().__init__(scene, gains)
        mattes = scene.open_mattes()
        assert mattes is not None
        self._mattes: FrameStore = mattes
        self._kept: OrderedDict[int, NDArray[np.uint8]] = OrderedDict()
        self.behind = np.full((len(self.cameras), 3), 0.5, np.float32)

    def shuffle(self, random: np.random.Generator) -> None:
        """Other colours behind the subject."""
        self.behind = random.random(self.behind.shape, np.float32)

    def frame(self, index: int) -> NDArray[np.uint8]:
        """(C, H W, 3): the subject over `behind`."""
        cut = self.cut(index)
        out = np.empty((*cut.shape[:2], 3), np.uint8)
        put_over(cut, self.behind, out)
        return out

    def cut(self, index: int) -> NDArray[np.uint8]:
        """(C, H W, 4) RGBA of a frame, colours times opacity."""
        found = self._kept.pop(index, None)
        if found is None:
            found = self._cut(index)
        self._kept[index] = found
        while len(self._kept) > 1 and len(self._kept) * found.nbytes > KEPT_BYTES:
            self._kept.popitem(last=False)
        return found

    def _cut(self, index: int) -> NDArray[np.uint8]:
        photos, plates = super().frame(index), self.plates()
        found = np.empty((*photos.shape[:2], 4), np.uint8)
        for position, (camera, photo, plate) in enumerate(zip(self.cameras, photos, plates, strict=True)):
            matte = self._mattes.image(camera, index)[..., 0]
            opacity, picture = matte / np.float32(255), photo.reshape(*matte.shape, 3) / np.float32(255)
            if plate is None:
                colour = opacity[..., None] * foreground(picture, opacity)
            else:
                colour = picture - (1 - opacity)[..., None] * (plate / np.float32(255))
            rgb = np.rint(255 * np.clip(colour, 0, opacity[..., None])).astype(np.uint8)
            found[position] = np.concatenate([rgb, matte[..., None]], -1).reshape(-1, 4)
        return found


def change_behind(images: Pictures, state: TextureState, random: np.random.Generator) -> bool:
    """Before a step: other colours behind cut-outs, and behind the layers; photos stay. Whether anything changed."""
    cut = images.images if isinstance(images, OneFrame) else images
    if not isinstance(cut, CutOuts):
        return False
    cut.shuffle(random)
    state.background[:] = torch.from_numpy(cut.behind)[:, None]
    return True


@kernel(parallel=True)
def put_over(cut, behind, out):  # type: ignore[no-untyped-def]
    """cut (C, P, 4) uint8 RGBA, premultiplied; behind (C, 3) float32 in [0, 1] -> out (C, P, 3) uint8."""
    for c in range(cut.shape[0]):
        for p in prange(cut.shape[1]):
            through = np.float32(255 - cut[c, p, 3])
            for q in range(3):
                value = np.float32(cut[c, p, q]) + through * behind[c, q] + np.float32(0.5)
                out[c, p, q] = np.uint8(min(value, np.float32(255.0)))
