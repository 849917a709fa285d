"""The normalised scene: what `normalize` writes and every later stage reads.

A folder with
- `scene.json`: cameras, split, times, the transform from the capture (this module's `Scene`);
- `frames.arrow`: all images, one row per (camera, frame) (`frames.FrameStore`);
- `masks.arrow`: true opacity of held-out images, where the capture has it (same format, one channel);
- `surface.npz`: tracked mesh in normalised coordinates, where the capture has one: `vertices` (K, V, 3) float32 and
  `faces` (F, 3) int32;
- `audio.wav`: the sound from the first frame on, where the capture has it.

Normalised world: the subject is at the origin, faces +x, up is +z, its left is +y; camera centres are about 1 unit
away.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_json
from facefolds_core.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity

SCENE_VERSION = 1
SPHERE_CENTRE = (-0.25, 0.0, 0.0)
"""The paper's c: 0.25 units behind the scene centre."""

Split = Literal["train", "holdout", "out"]
"""What a camera is for; "out" is nothing: a trainer does not believe it. No scene on disk has that."""
_REMEDY = "run `dvc repro` to make the normalised scene again"


@dataclass(frozen=True)
class Scene:
    """A normalised capture (without its pixels, which `open_frames` maps into memory).

    Attributes:
        subject: its name in params.yaml.
        cameras: C cameras, all of one image size, in the order of the rows of the frame store.
        splits: for each camera, "train" or "holdout".
        frame_ids: K names of frames in the capture.
        times: (K,) seconds from the first frame.
        fps: frames a second of the capture (playback rate of the asset); 0 for a static scene.
        from_capture: capture coordinates -> normalised coordinates.
        left_out: one line for each camera, frame or image of the capture that is not here, with the reason.
        folder: where it was read from.
    """

    subject: str
    cameras: tuple[Camera, ...]
    splits: tuple[Split, ...]
    frame_ids: tuple[str, ...]
    times: NDArray[np.float64]
    fps: float
    from_capture: Similarity
    left_out: tuple[str, ...]
    folder: Path

    @property
    def width(self) -> int:
        return self.cameras[0].width

    @property
    def height(self) -> int:
        return self.cameras[0].height

    @property
    def num_frames(self) -> int:
        return len(self.frame_ids)

    @property
    def audio(self) -> Path | None:
        """The sound from the first frame on, or None where the capture has none."""
        path = self.folder / "audio.wav"
        return path if path.is_file() else None

    def indices(self, split: Split) -> list[int]:
        """Indices of the cameras of one split."""
        return [i for i, s in enumerate(self.splits) if s == split]

    def open_frames(self) -> FrameStore:
        return FrameStore(self.folder / "frames.arrow")

    def open_masks(self) -> FrameStore | None:
        """True opacity (0..255, one channel) of some held-out images, or None where the capture has none."""
        path = self.folder / "masks.arrow"
        return FrameStore(path) if path.exists() else None

    def load_surface(self) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        """Tracked mesh: vertices (K, V, 3) and faces (F, 3), or None.

        Raises:
            UserError: if the file is damaged.
        """
        path = self.folder / "surface.npz"
        if not path.exists():
            return None
        try:
            with np.load(path, allow_pickle=False) as archive:
                return archive["vertices"], archive["faces"]
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise UserError(
                "the tracked mesh of the scene is damaged",
                file=path,
                expected="vertices and faces",
                found=str(error),
                remedy="run `dvc repro` to make the normalised scene again",
            ) from None


def write_scene(scene: Scene, folder: Path) -> None:
    """Write `scene.json` (only) into `folder`."""
    write_json(
        folder / "scene.json",
        {
            "version": SCENE_VERSION,
            "subject": scene.subject,
            "cameras": [
                {
                    "name": camera.name,
                    "split": split,
                    "width": camera.width,
                    "height": camera.height,
                    "K": camera.K.tolist(),
                    "w2c": camera.w2c.tolist(),
                }
                for camera, split in zip(scene.cameras, scene.splits, strict=True)
            ],
            "frame_ids": list(scene.frame_ids),
            "times": scene.times.tolist(),
            "fps": scene.fps,
            "from_capture": scene.from_capture.to_json(),
            "left_out": list(scene.left_out),
        },
    )


def read_scene(folder: str | Path) -> Scene:
    """Read a normalised scene.

    Raises:
        UserError: if `scene.json` is missing, garbled or of another version.
    """
    folder = Path(folder)
    path = folder / "scene.json"
    value: dict[str, Any] = read_json(path, remedy=_REMEDY)
    if value.get("version") != SCENE_VERSION:
        raise UserError(
            "a normalised scene of another version",
            file=path,
            expected=f"version {SCENE_VERSION}",
            found=value.get("version"),
            remedy=_REMEDY,
        )
    try:
        cameras = tuple(
            Camera(c["name"], np.array(c["K"], float), np.array(c["w2c"], float), int(c["width"]), int(c["height"]))
            for c in value["cameras"]
        )
        return Scene(
            subject=value["subject"],
            cameras=cameras,
            splits=tuple(c["split"] for c in value["cameras"]),
            frame_ids=tuple(value["frame_ids"]),
            times=np.array(value["times"], float),
            fps=float(value["fps"]),
            from_capture=Similarity.from_json(value["from_capture"]),
            left_out=tuple(value["left_out"]),
            folder=folder,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UserError("garbled scene.json", file=path, found=repr(error), remedy=_REMEDY) from None
