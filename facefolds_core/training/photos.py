"""The photos of one frame, with what a capture knows beside: clean plates, mattes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Photo:
    """One camera's picture of one frame.

    Attributes:
        image: (H, W, 3).
        plate: (H, W, 3) the same view without the subject, or None.
        matte: (H, W, 1) opacity of the subject, or None.
    """

    image: Image
    plate: Image | None = None
    matte: Image | None = None


@dataclass(frozen=True)
class PosedPhoto:
    """A photo, and where its camera stands.

    Attributes:
        camera: in the head's own frame.
        in_room: in the frame that the room has in the volume; the same of a head that stands still.
        number: of the camera among the training cameras.
    """

    photo: Photo
    camera: Camera
    in_room: Camera
    number: int


def posed_photos(scene: Scene, cameras: Sequence[int], frames: Sequence[int]) -> list[PosedPhoto]:
    """Photos of several frames; the room's frame is the head's in the first of them."""
    return [
        PosedPhoto(photo, scene.camera_in_head(c, k), scene.camera_in_head(c, frames[0]), number)
        for k in frames
        for number, (c, photo) in enumerate(zip(cameras, photos_of(scene, cameras, k), strict=True))
    ]


def photos_of(scene: Scene, cameras: Sequence[int], frame: int) -> list[Photo]:
    """Photos of a frame, memory-mapped."""
    images, plates, mattes = scene.open_frames(), scene.open_plates(), scene.open_mattes()
    return [
        Photo(
            images.image(c, frame),
            plates.image(c, 0) if plates is not None and (c, 0) in plates else None,
            mattes.image(c, frame) if mattes is not None and (c, frame) in mattes else None,
        )
        for c in cameras
    ]
