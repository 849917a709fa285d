"""What a training step is compared with: the subject alone, over a colour that changes from step to step.

The subject's opacity m is known in every training picture, and so its own colours F are: F = I - (1 - m) B before a
plate B, else they are estimated (`cut_from`). Layers are compared with F + (1 - m) g over any colour g, a new one for
each camera in each step: |C + T g - F - (1 - m) g|^2 asks for the right colour and for the right opacity at once,
inside, at the outline and outside. What stands behind need not be known, and nothing can be painted with it.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.cutout import cut_from
from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.training.explicit.teacher import Teacher
from facefolds_core.training.explicit.views import Images

KEPT_BYTES = 2 << 30
"""Of cut-outs that a training keeps in memory; others are made again when their frame's turn comes."""


class Pictures(Protocol):
    """Cut-outs of the training cameras, by frame."""

    @property
    def behind(self) -> NDArray[np.float32]:
        """(C, 3) in [0, 1]: the colour behind the subject and behind the layers, of each camera."""
        ...

    def shuffle(self, random: np.random.Generator) -> None:
        """Other colours behind."""
        ...

    def cut(self, index: int) -> NDArray[np.uint8]:
        """(C, H W, 4) RGBA of a frame, colours times opacity."""
        ...


class CutOuts:
    """See `Pictures`.

    Args:
        scene: with mattes of all training pictures.
        gains: (C, 3) of the training cameras' channels, which are taken out; None for none.
        kept_bytes: of cut-outs that are kept in memory; the last frame's always are.
        teacher: of virtual cameras, which come after the training cameras.
    """

    def __init__(
        self,
        scene: Scene,
        gains: NDArray[np.float64] | None = None,
        kept_bytes: int = KEPT_BYTES,
        teacher: Teacher | None = None,
    ) -> None:
        self._kept_bytes, self._teacher = kept_bytes, teacher
        self._photos = Images(scene, gains)
        mattes = scene.open_mattes()
        assert mattes is not None
        self._mattes: FrameStore = mattes
        self._kept: OrderedDict[int, NDArray[np.uint8]] = OrderedDict()
        virtual = 0 if teacher is None else len(teacher.virtual.cameras)
        self.behind = np.full((len(self._photos.cameras) + virtual, 3), 0.5, np.float32)

    def shuffle(self, random: np.random.Generator) -> None:
        self.behind = random.random(self.behind.shape, np.float32)

    def cut(self, index: int) -> NDArray[np.uint8]:
        found = self._kept.pop(index, None)
        if found is None:
            found = self._cut(index)
            if self._teacher is not None:
                photos = found
                virtual = self._teacher.cut(index, lambda frame: photos if frame == index else self._cut(frame))
                found = np.concatenate([photos, virtual])
        self._kept[index] = found
        while len(self._kept) > 1 and len(self._kept) * found.nbytes > self._kept_bytes:
            self._kept.popitem(last=False)
        return found

    def _cut(self, index: int) -> NDArray[np.uint8]:
        photos, plates = self._photos.frame(index), self._photos.plates()
        found = np.empty((*photos.shape[:2], 4), np.uint8)
        for position, (camera, photo, plate) in enumerate(zip(self._photos.cameras, photos, plates, strict=True)):
            matte = self._mattes.image(camera, index)[..., 0]
            opacity, picture = matte / np.float32(255), photo.reshape(*matte.shape, 3) / np.float32(255)
            behind = None if plate is None else plate / np.float32(255)
            rgb = np.rint(255 * cut_from(picture, opacity, behind)).astype(np.uint8)
            found[position] = np.concatenate([rgb, matte[..., None]], -1).reshape(-1, 4)
        return found


@dataclass(frozen=True)
class OneFrame:
    """The cut-outs of one frame, whichever is asked for."""

    pictures: Pictures
    index: int

    @property
    def behind(self) -> NDArray[np.float32]:
        return self.pictures.behind

    def shuffle(self, random: np.random.Generator) -> None:
        self.pictures.shuffle(random)

    def cut(self, index: int) -> NDArray[np.uint8]:
        return self.pictures.cut(self.index)
