"""Who stands where in a scene."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from facefolds_core.api.pictures import check_frame
from facefolds_core.api.scene import Scene
from facefolds_core.api.work import folders_of, run, set_params
from facefolds_core.captures.found_scene import GAUSSIANS, MATTES
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.files.pictures import open_picture
from facefolds_core.subject.storage import FoundSubject, read_found

SIDE = 600
"""Pixels of the longer side of the cut-outs in a notebook, at most."""


@dataclass(frozen=True)
class Subject:
    """The subject as it was found: Gaussians of one frame, and a matte of every picture.

    Attributes:
        scene: in which it stands.
        folder: with `sheet.png` to look at, and all mattes as pictures.
        found: the Gaussians, and what single cameras do differently.
    """

    scene: Scene
    folder: Path
    found: FoundSubject

    def __repr__(self) -> str:
        return f"Subject({self.scene.subject}: {len(self.found.splats)} Gaussians, PSNR {self.found.psnr:.1f} dB)"

    def matte(self, camera: str, frame: SupportsIndex) -> NDArray[np.uint8]:
        """(H, W) opacity of the subject in a picture, 0 to 255.

        Raises:
            UserError: if there is no such camera, frame or picture.
        """
        index, number = self.scene.index_of(camera), check_frame(frame, self.scene.num_frames, "the scene")
        store = FrameStore(self.folder / MATTES)
        if (index, number) not in store:
            raise UserError("the capture has no such picture", place=f"camera {camera}, frame {number}")
        return store.image(index, number)[..., 0]

    def _repr_jpeg_(self) -> bytes:
        """Cut-outs over green."""
        small = open_picture(self.folder / "sheet.png", ("PNG",)).convert("RGB")
        small.thumbnail((SIDE, SIDE))
        shown = io.BytesIO()
        small.save(shown, "JPEG", quality=80)
        return shown.getvalue()


def find_subject(scene: Scene, **params: Any) -> Subject:
    """Find the subject from the pictures alone: Gaussians of one frame, then a matte of every picture.

    Args:
        scene: of `normalize` or `load_scene`.
        params: keys of the section `subject`, such as `iterations=2500` (docs/reference/params.md).

    Raises:
        UserError: if the cameras do not look at one place, nothing stands out, or a key or value is wrong.
    """
    folders = folders_of(scene)
    set_params(folders, "subject", params)
    run("subject", folders, folders.subject)
    return found_in(scene)


def found_in(scene: Scene) -> Subject:
    """The subject that was found in a scene before."""
    folder = folders_of(scene).subject
    return Subject(scene, folder, read_found(folder / GAUSSIANS, len(scene.indices("train"))))
