"""From a capture to a scene, and scenes that were made before."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsIndex

from facefolds_core.api.cameras import camera_named
from facefolds_core.api.capture import Capture
from facefolds_core.api.pictures import Picture, check_frame
from facefolds_core.api.work import open_folders, run, set_params
from facefolds_core.captures import scene as scenes
from facefolds_core.captures.sketch import sketch
from facefolds_core.errors import UserError


@dataclass(frozen=True, repr=False)
class Scene(scenes.Scene):
    """A capture in the one convention: cameras, splits, frames; pixels stay on disk. A notebook shows its cameras.

    `left_out` says what of the capture is not in it, and what is odd.
    """

    def __repr__(self) -> str:
        count, frames = len(self.cameras), self.num_frames
        held = count - len(self.indices("train"))
        return (
            f"Scene({self.subject}: {count} cameras, {held} of them not for training, "
            f"{frames} frame{'s' * (frames > 1)}, {self.width} x {self.height} pixels)"
        )

    def index_of(self, camera: str) -> int:
        """Where a camera of this name stands in `cameras`.

        Raises:
            UserError: if there is none.
        """
        camera_named(camera, self.cameras, "camera")
        return [one.name for one in self.cameras].index(camera)

    def photo(self, camera: str, frame: SupportsIndex) -> Picture:
        """(H, W, 3) uint8, RGB: what a camera filmed.

        Raises:
            UserError: if there is no such camera, frame or picture.
        """
        index, number = self.index_of(camera), check_frame(frame, self.num_frames, "the scene")
        store = self.open_frames()
        if (index, number) not in store:
            raise UserError("the capture has no such picture", place=f"camera {camera}, frame {number}")
        return store.image(index, number)

    def _repr_html_(self) -> str:
        return sketch(self)


def read_scene(folder: Path) -> Scene:
    """A scene's folder; its pixels are read when they are asked for."""
    return Scene(**vars(scenes.read_scene(folder)))


def normalize(capture: Capture, **params: Any) -> Scene:
    """Bring a capture into the one convention: subject at the origin, facing +x, cameras about 1 away.

    Args:
        params: keys of the section `normalize`, such as `long_side=512` (docs/reference/params.md).

    Raises:
        UserError: if a picture is damaged, or anything else is wrong with the capture; or a key or value is wrong.
    """
    set_params(capture.folders, "normalize", params)
    run("normalize", capture.folders)
    return read_scene(capture.folders.scene)


def load_scene(path: str | Path, folder: str | Path | None = None) -> Scene:
    """Read a scene that was made before, and go on from it: what else lies beside it is taken over, nothing is changed.

    Args:
        path: `data/NAME/scene`.
        folder: of the work from here on, see `load_capture`. Where the scene lies in this folder (`data` above), the
            work goes on there, and what the steps make takes the place of what the stages made.

    Raises:
        UserError: if there is no scene, or it is damaged.
    """
    return read_scene(open_folders(scenes.read_scene(path), folder).scene)
