"""The normalised scene: what `normalize` writes and every later stage reads.

A folder with
- `scene.json`: cameras, split, times, the transform from the capture, and where the head turns much its pose in each
  frame (this module's `Scene`);
- `frames.arrow`: all images, one row per (camera, frame) (`frames.FrameStore`);
- `masks.arrow`: true opacity of images of cameras that do not train, where the capture has it (same format, one
  channel);
- `plates.arrow`: a clean plate, the picture without the subject, of cameras for which the capture has one (frame 0);
- `mattes.arrow`: opacity that training may use, of any camera and frame, where the capture has it (one channel);
- `surface.npz`: tracked mesh in the head's own frame, where the capture has one: `vertices` (K, V, 3) float32 and
  `faces` (F, 3) int32;
- `body.npz`: Gaussians of the whole scene, where they were fitted to find poses (subject/storage.py);
- `place.png`: the subject's centre, axes and ball over the pictures (`place.py`), for people;
- `audio.wav`: the sound from the first frame on, where the capture has it.

Normalised world: the subject is at the origin, faces +x, up is +z, its left is +y; camera centres are about 1 unit
away. Cameras stand in the world. The head's own frame is the world in which a turning head would stand in its mean
pose; without `poses` it is the world itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, read_fact
from facefolds_core.files.archives import read_npz
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.files.reading import is_there, remake
from facefolds_core.files.writing import read_json, write_json
from facefolds_core.geometry.cameras import Camera, check_camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.torso import Torso
from facefolds_core.geometry.track import Track

SCENE_VERSION = 3
SPHERE_CENTRE = (-0.25, 0.0, 0.0)
"""The paper's c: 0.25 units behind the scene centre."""
REACH = 0.45
"""Radius of the ball about the origin in which a subject is looked for, units, where the capture names none."""

Split = Literal["train", "validate", "holdout", "out"]
"""What a camera is for. "train": seen by every stage that fits something. "validate": set aside from training, for
whoever chooses between trainings. "holdout": for scores alone; nothing is chosen by it. "out": nothing, a trainer does
not believe it; no scene on disk has that."""


@dataclass(frozen=True)
class Scene:
    """A normalised capture (without its pixels, which `open_frames` maps into memory).

    Attributes:
        subject: its name in params.yaml.
        cameras: C cameras, all of one image size, in the order of the rows of the frame store.
        splits: for each camera, "train", "validate" or "holdout".
        frame_ids: K names of frames in the capture.
        times: (K,) seconds from the first frame.
        fps: frames a second of the capture (playback rate of the asset); 0 for a static scene.
        from_capture: capture coordinates -> normalised coordinates.
        left_out: a fact for each camera, frame or image of the capture that is not here, with the reason.
        folder: where it was read from.
        poses: the head's own frame -> world in each of the K frames; None where the head is taken to stand still.
        radius: of the ball about the origin that holds the subject, units; None where it is to be found.
        mattes: file of mattes in place of the scene's own, none at all if it is not there; None: the scene's own.
        gaussians: file of the subject's Gaussians in place of the scene's own; None: the scene's own.
    """

    subject: str
    cameras: tuple[Camera, ...]
    splits: tuple[Split, ...]
    frame_ids: tuple[str, ...]
    times: NDArray[np.float64]
    fps: float
    from_capture: Similarity
    left_out: tuple[Fact, ...]
    folder: Path
    poses: Track | None = None
    radius: float | None = None
    mattes: Path | None = None
    gaussians: Path | None = None

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

    @property
    def choice_split(self) -> Split:
        """The cameras by which something may be chosen: those for validation; without any, the held-out ones."""
        return "validate" if "validate" in self.splits else "holdout"

    def camera_in_head(self, index: int, frame: int) -> Camera:
        """Camera `index` as it stands in the head's own frame in frame `frame`: all rays at the subject are its."""
        return self.cameras[index] if self.poses is None else self.poses.camera(self.cameras[index], frame)

    def with_torso(self, torso: Torso | None) -> Scene:
        """With what stays in the room while the head turns, of a head that does."""
        return self if self.poses is None else replace(self, poses=replace(self.poses, torso=torso))

    def views_of(self, split: Split, poses: int = 1) -> list[Camera]:
        """Cameras of one split in the head's own frame: of a still head the cameras, else each in `poses` frames.

        The frames are spread evenly, and differ from camera to camera, so that few cameras see the head in most poses.
        Of a torso each sees once more how it was made.
        """
        indices, frames = self.indices(split), self.num_frames
        if self.poses is None:
            return [self.cameras[i] for i in indices]
        count = min(poses, frames)
        turns = [
            (position + part * len(indices)) * frames // (count * len(indices))
            for position in range(len(indices))
            for part in range(count)
        ]
        found = [self.camera_in_head(i, k) for i, k in zip(np.repeat(indices, count), turns, strict=True)]
        if self.poses.torso is None:
            return found
        made = self.poses.torso.rest.inverse()
        return [*found, *(self.cameras[i].transformed(made) for i in indices)]

    def stored(self, path: Path) -> FrameStore | None:
        """The scene's frames of a frame store, or None where there is none."""
        return FrameStore(path) if is_there(path) else None

    def open_frames(self) -> FrameStore:
        return FrameStore(self.folder / "frames.arrow")

    def open_masks(self) -> FrameStore | None:
        """True opacity (0..255, one channel) of some scored images, or None where the capture has none."""
        return self.stored(self.folder / "masks.arrow")

    def open_plates(self) -> FrameStore | None:
        """Clean plates, (camera, 0) -> the picture without the subject, of some cameras; None where there is none."""
        return Scene.stored(self, self.folder / "plates.arrow")  # those of a part are the scene's

    def open_mattes(self) -> FrameStore | None:
        """Opacity (0..255, one channel) that training may use, of some images of any camera; None without any."""
        return self.stored(self.folder / "mattes.arrow" if self.mattes is None else self.mattes)

    def found_gaussians(self) -> Path | None:
        """File of the subject's Gaussians (subject/storage.py); None until it has been found."""
        path = self.folder / "gaussians.npz" if self.gaussians is None else self.gaussians
        return path if is_there(path) else None

    def load_surface(self) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        """Tracked mesh: vertices (K, V, 3) and faces (F, 3), or None. They stay in the file: a take has many."""
        path = self.folder / "surface.npz"
        if not is_there(path):
            return None
        message = "the tracked mesh of the scene is damaged"
        arrays = read_npz(path, message, mapped=True)
        vertices, faces = arrays.get("vertices"), arrays.get("faces")
        if (
            vertices is None
            or faces is None
            or (vertices.dtype.name, faces.dtype.name) != ("float32", "int32")
            or (vertices.shape[:1], vertices.shape[2:], faces.shape[1:]) != ((self.num_frames,), (3,), (3,))
            or min(vertices.size, faces.size) == 0
            or not all(np.isfinite(points).all() for points in vertices)
            or faces.min() < 0
            or faces.max() >= vertices.shape[1]
        ):
            found = {name: f"{array.dtype} {array.shape}" for name, array in arrays.items()}
            expected = f"finite vertices ({self.num_frames}, V, 3), and faces (F, 3) that name them"
            raise UserError(message, file=path, expected=expected, found=found, remedy=remake(path))
        return vertices, faces


def write_scene(scene: Scene, folder: Path) -> None:
    """Write `scene.json` (only) into `folder`."""
    cameras = [
        {"name": c.name, "split": split, "width": c.width, "height": c.height, "K": c.K.tolist(), "w2c": c.w2c.tolist()}
        for c, split in zip(scene.cameras, scene.splits, strict=True)
    ]
    poses = None
    if scene.poses is not None:
        pairs = zip(scene.poses.quaternions.tolist(), scene.poses.translations.tolist(), strict=True)
        poses = [{"quaternion": q, "translation": t} for q, t in pairs]
    value = {
        "version": SCENE_VERSION,
        "subject": scene.subject,
        "cameras": cameras,
        "frame_ids": list(scene.frame_ids),
        "times": scene.times.tolist(),
        "fps": scene.fps,
        "from_capture": scene.from_capture.to_json(),
        "left_out": [one.to_json() for one in scene.left_out],
        "poses": poses,
        "radius": scene.radius,
    }
    write_json(folder / "scene.json", value)


def _read_poses(value: Any) -> Track | None:
    if value is None:
        return None
    rows = [[*one["quaternion"], *one["translation"]] for one in value]
    numbers = np.array(rows, float).reshape(len(rows), 7)
    return Track(numbers[:, :4].copy(), numbers[:, 4:].copy())


def check_frames(what: str, frames: int, scene: Scene) -> None:
    """Raises UserError unless an asset, or a model, has as many frames as the scene; `what` says which it is."""
    if frames != scene.num_frames:
        raise UserError(
            f"the {what} and the scene have different numbers of frames",
            file=scene.folder / "scene.json",
            expected=f"{scene.num_frames} frames, as in the scene",
            found=f"{frames} in the {what}",
            remedy="run `dvc repro`, which makes both from the same scene",
        )


def read_scene(folder: str | Path) -> Scene:
    """Read a normalised scene.

    Raises:
        UserError: if `scene.json` is missing, garbled or of another version.
    """
    folder = Path(folder)
    path = folder / "scene.json"
    remedy = remake(path)
    value: Any = read_json(path, remedy=remedy)
    if not isinstance(value, dict) or value.get("version") != SCENE_VERSION:
        raise UserError(
            "a normalised scene of another version",
            file=path,
            expected=f"version {SCENE_VERSION}",
            found=value.get("version") if isinstance(value, dict) else type(value).__name__,
            remedy=remedy,
        )
    try:
        cameras = tuple(
            Camera(c["name"], np.array(c["K"], float), np.array(c["w2c"], float), int(c["width"]), int(c["height"]))
            for c in value["cameras"]
        )
        scene = Scene(
            subject=value["subject"],
            cameras=cameras,
            splits=tuple(c["split"] for c in value["cameras"]),
            frame_ids=tuple(value["frame_ids"]),
            times=np.array(value["times"], float),
            fps=float(value["fps"]),
            from_capture=Similarity.from_json(value["from_capture"]),
            left_out=tuple(read_fact(one) for one in value["left_out"]),
            folder=folder,
            poses=_read_poses(value["poses"]),
            radius=None if value["radius"] is None else float(value["radius"]),
        )
        _check(scene)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise UserError("garbled scene.json", file=path, found=repr(error)[:300], remedy=remedy) from None
    for i, camera in enumerate(scene.cameras):
        check_camera(camera, path, f"cameras[{i}] ({camera.name})")
    return scene


def _check(scene: Scene) -> None:
    """ValueError for what `write_scene` never writes; the cameras' numbers are checked by `check_camera`."""
    cameras, frames = scene.cameras, len(scene.frame_ids)
    words = [scene.subject, *scene.frame_ids, *(camera.name for camera in cameras)]
    if not cameras or not frames or not all(isinstance(word, str) for word in words):
        raise ValueError("no cameras, no frames, or names that are no text")
    if any((c.K.shape, c.w2c.shape) != ((3, 3), (3, 4)) for c in cameras):
        raise ValueError("matrices of the wrong shape")
    if len({(c.width, c.height) for c in cameras}) != 1 or not 1 <= min(scene.width, scene.height) <= 1 << 20:
        raise ValueError("image sizes that differ, or are none")
    if not set(scene.splits) <= {"train", "validate", "holdout"}:
        raise ValueError(f"splits {sorted(set(scene.splits))}")
    if scene.times.shape != (frames,) or not np.isfinite([*scene.times, scene.fps]).all() or not 0 <= scene.fps < 1e4:
        raise ValueError("times or a rate that are none")
    if scene.poses is not None and (problems := scene.poses.problems(frames)):
        raise ValueError(f"poses: {problems[0]}")
    if scene.radius is not None and not 0 < scene.radius < 10:
        raise ValueError("a ball without a size")
    move = scene.from_capture
    numbers = [move.scale, *move.rotation.flat, *move.translation.flat]
    shaped = (move.rotation.shape, move.translation.shape) == ((3, 3), (3,))
    if not (shaped and move.scale > 0 and np.isfinite(numbers).all()):
        raise ValueError("from_capture is no similarity")
