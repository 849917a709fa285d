"""What a training step is compared with: the subject alone, over a colour that changes from step to step, or over all.

The subject's opacity m is known in every training picture, and so its own colours F are: F = I - (1 - m) B before a
plate B, else they are estimated (`cut_from`). Layers are compared with F + (1 - m) g over any colour g, a new one for
each camera in each step: |C + T g - F - (1 - m) g|^2 asks for the right colour and for the right opacity at once,
inside, at the outline and outside. What stands behind need not be known, and nothing can be painted with it.

One colour a step is noise: where opacity is wrong, colours are drawn to g in turn. Early on that keeps them from
explaining what is an error of opacity: over all colours at once from the first step on, actor with 8 cameras loses
.3 dB over any background and .7 inside, on cameras left out. Late it stays in the textures: 8 codes of colour in
`buddha`, whose photos are grey, and 26 % of the video's bytes in `studio`. So training ends with the mean over all
colours.
"""

from __future__ import annotations

from collections import OrderedDict

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.cutout import cut_from
from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.training.explicit.teacher import Teacher

KEPT_BYTES = 2 << 30
"""Of cut-outs that a training keeps in memory; others are made again when their frame's turn comes."""


ALL_COLOURS = np.array([0.5, 0.5, 0.5, 3 / 12], np.float32)
"""Mean and variance, summed over the channels, of all colours in [0, 1]."""


class CutOuts:
    """Cut-outs of the training cameras, by frame; all their images must be there (`check_images`).

    Attributes:
        behind: (C, 4): of the colours in [0, 1] behind the subject and behind the layers, of each camera, the mean and
            the variance, summed over the channels: 0 of a single one.
        only: the one frame that is shown, whichever is asked for; None for all.

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
        self._tables = None if gains is None or np.all(gains == 1) else _tables(gains)
        self._cameras, self._photos, self._plates = scene.indices("train"), scene.open_frames(), scene.open_plates()
        mattes = scene.open_mattes()
        assert mattes is not None
        self._mattes: FrameStore = mattes
        self._kept: OrderedDict[int, NDArray[np.uint8]] = OrderedDict()
        virtual = 0 if teacher is None else len(teacher.virtual.cameras)
        self.behind = np.empty((len(self._cameras) + virtual, 4), np.float32)
        self.only: int | None = None
        self.average()

    def shuffle(self, random: np.random.Generator) -> None:
        """Another colour behind, of each camera."""
        self.behind[:, :3], self.behind[:, 3] = random.random((len(self.behind), 3), np.float32), 0

    def average(self) -> None:
        """All colours behind, none more likely than another."""
        self.behind[:] = ALL_COLOURS

    def cut(self, index: int) -> NDArray[np.uint8]:
        """(C, H W, 4) RGBA of a frame, colours times opacity."""
        index = index if self.only is None else self.only
        found = self._kept.pop(index, None)
        if found is None:
            found = self.photos(index)
            if self._teacher is not None:
                photos = found
                virtual = self._teacher.cut(index, lambda frame: photos if frame == index else self.photos(frame))
                found = np.concatenate([photos, virtual])
        self._kept[index] = found
        while len(self._kept) > 1 and len(self._kept) * found.nbytes > self._kept_bytes:
            self._kept.popitem(last=False)
        return found

    def photos(self, index: int) -> NDArray[np.uint8]:
        """The same of the training cameras alone, made anew."""
        height, width = self._photos.height, self._photos.width
        found = np.empty((len(self._cameras), height * width, 4), np.uint8)
        for position, camera in enumerate(self._cameras):
            matte, plate = self._mattes.image(camera, index)[..., 0], None
            if self._plates is not None and (camera, 0) in self._plates:
                plate = self._alike(position, self._plates.image(camera, 0)) / np.float32(255)
            photo = self._alike(position, self._photos.image(camera, index)) / np.float32(255)
            rgb = np.rint(255 * cut_from(photo, matte / np.float32(255), plate)).astype(np.uint8)
            found[position] = np.concatenate([rgb, matte[..., None]], -1).reshape(-1, 4)
        return found

    def _alike(self, position: int, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """An image of the camera at a position of the list, without its gains."""
        return image if self._tables is None else cv2.LUT(image, self._tables[position]).astype(np.uint8)


def _tables(gains: NDArray[np.float64]) -> list[NDArray[np.uint8]]:
    """(1, 256, 3) for each camera: 8-bit values without its gains (3,)."""
    values = np.arange(256)[None, :, None] / gains[:, None, None, :]
    return list(np.rint(values.clip(0, 255)).astype(np.uint8))
