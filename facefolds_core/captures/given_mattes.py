"""Mattes from a folder that the user names: CAMERA.png for all frames, CAMERA/FRAME.png for one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.picture import FilePicture
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.facts import shorten

Image = NDArray[np.uint8]
SKEW = 0.02
"""Ratios of the sides of matte and picture may differ by this share: one pixel of fifty."""


def given_mattes(folder: Path, scene: Scene) -> Iterator[tuple[int, int, Image]]:
    """(camera, frame, (H, W, 1) opacity) of each picture of the scene that the folder has a matte for.

    They are of the scene's pictures, that is without lens distortion, of any size.
    """
    files = dict(_files(folder, scene))
    if not files:
        raise UserError(
            "no mattes",
            file=folder,
            place="mattes",
            expected=f"CAMERA.png or CAMERA/FRAME.png of the cameras {shorten([c.name for c in scene.cameras], 100)}",
            found="a folder without them" if folder.is_dir() else "no such folder",
            remedy="copy some from data/SUBJECT/subject, correct the path, or take `mattes` of this subject out",
        )
    for (camera, frame), path in files.items():
        place = f"matte of camera {scene.cameras[camera].name}, frame {scene.frame_ids[frame]}"
        matte = FilePicture(path).opacity(place)
        height, width = matte.shape[:2]
        if abs(width / height * scene.height / scene.width - 1) > SKEW:
            raise UserError(
                "a matte of another shape",
                file=path,
                place=place,
                expected=f"{scene.width} x {scene.height} pixels, or the same enlarged or reduced",
                found=f"{width} x {height}",
                remedy="make mattes of the scene's pictures, which are freed from lens distortion",
            )
        size = (scene.width, scene.height)
        yield camera, frame, np.asarray(cv2.resize(matte, size, interpolation=cv2.INTER_AREA), np.uint8)[..., None]


def _files(folder: Path, scene: Scene) -> Iterator[tuple[tuple[int, int], Path]]:
    for index, frame in scene.open_frames():  # held-out cameras may lack some
        camera, name = scene.cameras[index].name, scene.frame_ids[frame]
        for path in (folder / camera / f"{name}.png", folder / f"{camera}.png"):
            if path.is_file():
                yield (index, frame), path
                break
