"""The training views as rays with stored crossings."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radial_kernel import texture_positions


@dataclass(frozen=True)
class Views:
    """P rays of C training cameras that cross at least one layer.

    Attributes:
        codes: (P, N, 2) uint16 (`hit_codes`): the crossing with each layer, over the window. A texel of 512 is 128
            steps.
        camera: (P,) int32, position in the list of training cameras.
        pixel: (P,) int32, row-major.
        directions: (P, 3) float32, unit vectors.
    """

    codes: NDArray[np.uint16]
    camera: NDArray[np.int32]
    pixel: NDArray[np.int32]
    directions: NDArray[np.float32]


def trace_views(scene: Scene, manifolds: RadialManifolds, stride: int) -> Views:
    """Cross every `stride`-th pixel of each training camera (a different set in each) with the layers.

    Raises:
        UserError: if no ray of any camera crosses a layer.
    """
    codes, cameras, pixels, along = [], [], [], []
    centre = manifolds.centre.cpu().numpy().astype(np.float64)
    window = np.array(manifolds.window)
    for position, index in enumerate(scene.indices("train")):
        origins, directions = scene.cameras[index].rays()
        first = position * 7 % stride
        chosen = np.arange(first, scene.height * scene.width, stride)
        offsets = np.ascontiguousarray(origins.reshape(-1, 3)[chosen] - centre)
        directions = np.ascontiguousarray(directions.reshape(-1, 3)[chosen])
        distance = manifolds.compiled_distances(offsets, directions)
        hit = np.flatnonzero((distance > 0).any(1))
        codes.append(texture_positions(offsets[hit], directions[hit], distance[hit], window))
        cameras.append(np.full(len(hit), position, np.int32))
        pixels.append(chosen[hit].astype(np.int32))
        along.append(directions[hit].astype(np.float32))
    views = Views(np.concatenate(codes), np.concatenate(cameras), np.concatenate(pixels), np.concatenate(along))
    if len(views.pixel) == 0:
        raise UserError(
            "no pixel of any training camera sees the subject",
            file=scene.folder / "scene.json",
            expected="cameras that look at the origin",
            remedy="check the capture's calibration, and `front` or the head poses",
        )
    return views


def check_images(scene: Scene) -> None:
    """Refuse a scene in which a training camera lacks a frame: each camera's background is learnt from all of them.

    Raises:
        UserError: naming the camera and the frame.
    """
    store = scene.open_frames()
    for camera in scene.indices("train"):
        for frame in range(scene.num_frames):
            if (camera, frame) not in store:
                raise UserError(
                    "a training image is missing",
                    file=store.path,
                    place=f"camera {scene.cameras[camera].name}, frame {scene.frame_ids[frame]}",
                    expected="every frame of every camera: the explicit model learns one background each",
                    remedy="for a stabilised scene, whose cameras move, set `train: {preset: quick}`; else run "
                    "`dvc repro` to make the normalised scene again",
                )


class Images:
    """The training images of one frame at a time, from the memory-mapped store; all must be there (`check_images`).

    Args:
        gains: (C, 3) of the training cameras' channels, which are taken out; None for none.
    """

    def __init__(self, scene: Scene, gains: NDArray[np.float64] | None = None) -> None:
        self.tables = None if gains is None or np.all(gains == 1) else _tables(gains)
        self.store = scene.open_frames()
        self.cameras = scene.indices("train")

    def frame(self, index: int) -> NDArray[np.uint8]:
        """(C, H W, 3)."""
        images = [self.store.image(c, index) for c in self.cameras]
        if self.tables is not None:
            images = [cv2.LUT(image, table).astype(np.uint8) for image, table in zip(images, self.tables, strict=True)]
        return np.stack([image.reshape(-1, 3) for image in images])


def _tables(gains: NDArray[np.float64]) -> list[NDArray[np.uint8]]:
    """(1, 256, 3) for each camera: 8-bit values without its gains (3,)."""
    values = np.arange(256)[None, :, None] / gains[:, None, None, :]
    return list(np.rint(values.clip(0, 255)).astype(np.uint8))
