"""Mattes of a scene's pictures: beside clean plates, or from the pictures alone, where the starting volume says roughly
where the subject is, each picture says it to the pixel, and the pictures vote."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import OutlineParams
from facefolds_core.training.mattes.cut_out import cut_out, opacity_in, reduced
from facefolds_core.training.mattes.plates import from_plate
from facefolds_core.training.mattes.vote import agreed, outvoted
from facefolds_core.training.volume.fit import Volume

Image = NDArray[np.uint8]
Source = Literal["capture", "named", "plate", "picture"]
"""Whence a matte is: it came with the capture, the user has named it, or it was found."""
Key = tuple[int, int]
"""(camera, frame) in the scene."""


@dataclass(frozen=True)
class CutOut:
    """One picture's subject.

    Attributes:
        camera, frame: indices in the scene.
        image: (h, w, 3), reduced.
        matte: (h, w) opacity, 0..255.
        source: whence it is.
        agreement: IoU with what the training cameras agree on; None where none was asked.
        believed: whether it is not outvoted.
    """

    camera: int
    frame: int
    image: Image
    matte: Image
    source: Source
    agreement: float | None = None
    believed: bool = True

    def opacity(self, height: int, width: int) -> Image:
        """(height, width) 0..255, with edges as soft as the reduction was coarse."""
        return np.asarray(cv2.resize(self.matte, (width, height), interpolation=cv2.INTER_LINEAR), np.uint8)


def wanted_pictures(scene: Scene, frames: Sequence[int]) -> list[Key]:
    """(camera, frame) of the pictures that serve something: of training cameras those that the volume is fitted to,
    of the others all, by which they are scored.

    Args:
        frames: of the volume.
    """
    store, training = scene.open_frames(), set(scene.indices("train"))
    return [
        (camera, frame)
        for camera in range(len(scene.cameras))
        for frame in (frames if camera in training else range(scene.num_frames))
        if (camera, frame) in store
    ]


def beside_plates(scene: Scene, pictures: Sequence[Key], params: OutlineParams) -> list[CutOut]:
    """Of those pictures whose cameras have a clean plate."""
    plates, found = scene.open_plates(), list[CutOut]()
    for index, frame in pictures:
        if plates is not None and (index, 0) in plates:
            image = small(scene, scene.open_frames().image(index, frame), params)
            opacity = from_plate(image, small(scene, plates.image(index, 0), params), params.plates)
            found.append(CutOut(index, frame, image, np.rint(255 * opacity).astype(np.uint8), "plate"))
    return found


def small(scene: Scene, image: Image, params: OutlineParams) -> Image:
    """A picture as it is cut out."""
    camera = reduced(scene.cameras[0], params.cut_out.long_side)
    return np.asarray(cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_AREA), np.uint8)


def from_pictures(
    scene: Scene,
    volume: Volume,
    pictures: Sequence[Key],
    params: OutlineParams,
    bar: tqdm,
    sure: Mapping[Key, Image] | None = None,
) -> list[CutOut]:
    """Cut the subject out of each of `pictures`, and let those of training cameras vote in which there is something;
    fewer than see a voxel for it to be anybody's do not. None is believed that has nothing in common with what
    they agree on, or is empty where nobody votes.

    Args:
        volume: with the subject alone in it.
        bar: advanced by one a picture.
        sure: mattes of other pictures, which vote, too: reduced, (h, w) 0..255.
    """
    store, training = scene.open_frames(), set(scene.indices("train"))
    cameras, images, cut = list[Camera](), list[Image](), list[Image]()
    for index, frame in pictures:
        cameras.append(_camera(scene, (index, frame), params))
        images.append(small(scene, store.image(index, frame), params))
        cut.append(cut_out(images[-1], opacity_in(volume, cameras[-1]), params.cut_out))
        bar.update()
    voters = [(cameras[n], cut[n]) for n, (index, frame) in enumerate(pictures) if index in training]
    voters += [(_camera(scene, key, params), (matte > 127).astype(np.uint8)) for key, matte in (sure or {}).items()]
    voters = [(camera, matte) for camera, matte in voters if matte.any()]
    if len(voters) < params.vote.min_views:
        found = zip(pictures, images, cut, strict=True)
        return [CutOut(*key, image, 255 * matte, "picture", None, bool(matte.any())) for key, image, matte in found]
    hull = agreed(volume, [camera for camera, _ in voters], [matte for _, matte in voters], params.vote)
    mended, agreement = outvoted(hull, cameras, cut, params.vote)
    least = params.vote.least * float(np.median(agreement)) if len(agreement) else 0.0
    return [
        CutOut(*key, image, 255 * matte, "picture", float(share), bool(share >= least and share > 0))
        for key, image, matte, share in zip(pictures, images, mended, agreement, strict=True)
    ]


def _camera(scene: Scene, key: Key, params: OutlineParams) -> Camera:
    """Of a picture as it is cut out."""
    return reduced(scene.camera_in_head(*key), params.cut_out.long_side)
