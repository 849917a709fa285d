"""Mattes of a scene from its pictures alone: the starting volume says roughly where the subject is, each picture says
it to the pixel, and the pictures vote."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import ExplicitParams
from facefolds_core.training.mattes.cut_out import cut_out, opacity_in, reduced
from facefolds_core.training.mattes.vote import agreed, outvoted
from facefolds_core.training.volume.fit import Volume

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class CutOut:
    """One picture's subject.

    Attributes:
        camera, frame: indices in the scene.
        image: (h, w, 3), reduced.
        matte: (h, w) 1 where the subject is.
        agreement: IoU with what the training cameras agree on.
        believed: whether it is not outvoted.
    """

    camera: int
    frame: int
    image: Image
    matte: Image
    agreement: float
    believed: bool

    def opacity(self, height: int, width: int) -> Image:
        """(height, width) 0..255, with edges as soft as the reduction was coarse."""
        return np.asarray(cv2.resize(255 * self.matte, (width, height), interpolation=cv2.INTER_LINEAR), np.uint8)


def wanted_pictures(scene: Scene, volume: Volume, frames: list[int] | None = None) -> list[tuple[int, int]]:
    """(camera, frame) of the pictures that serve something: of training cameras those that the volume is fitted to,
    of the others all, by which they are scored.

    Args:
        frames: of the volume; by default the one that it was fitted to.
    """
    store, fitted = scene.open_frames(), [volume.frame] if frames is None else frames
    training = set(scene.indices("train"))
    return [
        (camera, frame)
        for camera in range(len(scene.cameras))
        for frame in (fitted if camera in training else range(scene.num_frames))
        if (camera, frame) in store
    ]


def find_mattes(
    scene: Scene, volume: Volume, pictures: list[tuple[int, int]], params: ExplicitParams, bar: tqdm
) -> list[CutOut]:
    """Cut the subject out of each of `pictures`, and let those of training cameras vote.

    Args:
        volume: with the subject alone in it.
        bar: advanced by one a picture.
    """
    store, training, wanted = scene.open_frames(), set(scene.indices("train")), params.mattes
    cameras, images, cut = list[Camera](), list[Image](), list[Image]()
    for index, frame in pictures:
        camera = reduced(scene.camera_in_head(index, frame), wanted.cut_out.long_side)
        size = (camera.width, camera.height)
        image = np.asarray(cv2.resize(store.image(index, frame), size, interpolation=cv2.INTER_AREA), np.uint8)
        cameras.append(camera)
        images.append(image)
        cut.append(cut_out(image, opacity_in(volume, camera), wanted.cut_out))
        bar.update()
    voters = [n for n, (index, frame) in enumerate(pictures) if index in training]
    hull = agreed(volume, [cameras[n] for n in voters], [cut[n] for n in voters], wanted.vote)
    mended, agreement = outvoted(hull, cameras, cut, wanted.vote)
    least = wanted.vote.least * float(np.median(agreement)) if len(agreement) else 0.0
    return [
        CutOut(*key, image, matte, float(share), bool(share >= least))
        for key, image, matte, share in zip(pictures, images, mended, agreement, strict=True)
    ]
