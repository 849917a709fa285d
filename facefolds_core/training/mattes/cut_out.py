"""One picture's matte: GrabCut, begun from how opaque the starting volume is on each pixel's ray."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CutOutParams
from facefolds_core.training.volume.fit import Volume

Array = NDArray[np.float32]
Image = NDArray[np.uint8]


def reduced(camera: Camera, long_side: int) -> Camera:
    """The camera of a smaller picture, or itself."""
    scale = min(1.0, long_side / max(camera.width, camera.height))
    return camera.resized(max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))


def opacity_in(volume: Volume, camera: Camera) -> Array:
    """(H, W) of the volume on the rays of all pixels."""
    origins, directions = camera.rays()
    flat = [np.ascontiguousarray(part.reshape(-1, 3), np.float32) for part in (origins, directions)]
    return volume.render(*flat)[1].reshape(camera.height, camera.width)


def cut_out(image: Image, opacity: Array, params: CutOutParams) -> Image:
    """(H, W) 1 where the subject is, else 0.

    Args:
        image: (H, W, 3).
        opacity: (H, W) of the volume; where it is high or low, and far from where it is neither, it is believed.
    """
    labels = np.where(opacity > 0.5, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    core = cv2.erode((opacity > params.inside).astype(np.uint8), _disc(pixels(params.erode, opacity)))
    near = cv2.dilate((opacity > params.outside).astype(np.uint8), _disc(pixels(params.dilate, opacity)))
    labels[core > 0], labels[near == 0] = cv2.GC_FGD, cv2.GC_BGD
    subject = (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)
    if not subject.all() and subject.any():
        cv2.setRNGSeed(0)  # its clusters begin at random
        models = np.zeros((2, 1, 65))
        picture = np.ascontiguousarray(image[..., ::-1])
        cv2.grabCut(picture, labels, (0, 0, 1, 1), models[0], models[1], params.iterations, cv2.GC_INIT_WITH_MASK)
        subject = (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)
    return np.asarray(subject, np.uint8)


def pixels(share: float, picture: Array | Image) -> int:
    """A share of a picture's longer side, (H, W): what is blurred is as blurred on a small picture."""
    return round(share * float(max(picture.shape)))


def _disc(radius: int) -> Image:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1)), np.uint8)


def grown(silhouette: Image, radius: int) -> Image:
    """(H, W) 0 or 1, dilated by so many pixels."""
    return np.asarray(cv2.dilate(silhouette, _disc(radius)), np.uint8)
