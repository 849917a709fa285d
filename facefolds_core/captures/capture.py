"""A capture as read from disk, before it is normalised: cameras, where the images lie, tracked mesh. No pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.images import Colour
from facefolds_core.captures.lens import Lens
from facefolds_core.captures.picture import Picture
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.geometry.cameras import Array, Camera
from facefolds_core.params import FrameRange, Subject
from facefolds_core.system.spill import by_rows

RATES = (0.1, 1000.0)
"""Frames a second of a capture."""


@dataclass(frozen=True)
class View:
    """One camera of a capture.

    Attributes:
        camera: a pinhole without distortion, in the capture's world, for full-size images.
        lens: how to get the pinhole image from the photo; None where the photo is one.
        colour: what brings the camera's colours to those of the others; None where they need nothing.
    """

    camera: Camera
    lens: Lens | None = None
    colour: Colour | None = None

    @property
    def name(self) -> str:
        return self.camera.name


@dataclass(frozen=True)
class Tracking:
    """The tracked head.

    Attributes:
        poses: (K, 3, 4) head -> world, X_w = R X + t; in the head frame the face looks to +z, up is +y.
        vertices: (K, V, 3) in the head frame.
        faces: (F, 3) int32, or None where the capture has no topology.
    """

    poses: Array
    vertices: Array
    faces: NDArray[np.int32] | None

    def world_vertices(self, frames: Sequence[int] | None = None) -> Array:
        """(K, V, 3) in the capture's world, of all frames or some."""
        chosen = np.arange(len(self.poses)) if frames is None else np.asarray(frames, int)

        def moved(rows: slice) -> Array:
            poses = self.poses[chosen[rows]]
            return np.asarray(
                np.einsum("kij,kvj->kvi", poses[:, :, :3], self.vertices[chosen[rows]]) + poses[:, None, :, 3]
            )

        return by_rows(len(chosen), moved)


@dataclass(frozen=True)
class Sound:
    """What was heard.

    Attributes:
        path: of the sound file.
        seconds: K, where in it each of the capture's frames lies.
    """

    path: Path
    seconds: tuple[float, ...]


@dataclass(frozen=True)
class Capture:
    """Cameras, frames and files of one capture.

    Attributes:
        root: its folder.
        views: cameras, in the order of the capture's own list.
        frame_ids: K names of frames, sorted.
        fps: frames a second; 0 for a static capture.
        images: (camera index, frame index) -> where it lies. Incomplete where the capture is.
        masks: likewise, opacity by which held-out images are scored, where there is any.
        tracking: for all K frames, or None.
        left_out: a fact for each thing of the capture that is not here, with the reason, and for each guess made.
        sound: None where the capture is silent.
        plates: camera index -> a clean plate, the same camera's picture without the subject.
        mattes: (camera index, frame index) -> opacity that training may use, of any camera.
    """

    root: Path
    views: tuple[View, ...]
    frame_ids: tuple[str, ...]
    fps: float
    images: Mapping[tuple[int, int], Picture]
    masks: Mapping[tuple[int, int], Picture]
    tracking: Tracking | None
    left_out: tuple[Fact, ...]
    sound: Sound | None = None
    plates: Mapping[int, Picture] = field(default_factory=dict)
    mattes: Mapping[tuple[int, int], Picture] = field(default_factory=dict)

    def place(self, camera: int, frame: int) -> str:
        """Words for one image, for messages."""
        return f"camera {self.views[camera].name}, frame {self.frame_ids[frame]}"

    def plate_place(self, camera: int) -> str:
        """Words for a clean plate."""
        return f"clean plate of camera {self.views[camera].name}"


def select_frames(
    names: Sequence[str], wanted: FrameRange | tuple[str, ...] | None, file: Path, what: str
) -> list[str]:
    """The frames that `subjects.<name>.frames` asks for, out of the capture's sorted `names`."""
    wrong = partial(UserError, file=file, place="frames", remedy="correct `frames` of this subject in params.yaml")
    if isinstance(wanted, tuple):
        unknown = [name for name in wanted if name not in names]
        if unknown or not wanted:
            message = f"frames of `subjects` that {what} does not have" if unknown else "an empty list of frames"
            raise wrong(message, expected=f"some of {shorten(names)}", found=shorten(unknown))
        return sorted(set(wanted), key=list(names).index)
    if wanted is None:
        return list(names)
    chosen = list(names)[wanted.start : wanted.stop : wanted.step]
    if not chosen:
        raise wrong(
            "the range of frames is empty",
            expected=f"positions from 0 to {len(names) - 1} ({what} has {len(names)} frames: {shorten(names)})",
            found=f"start {wanted.start}, stop {wanted.stop}, step {wanted.step}",
        )
    return chosen


def frame_rate(subject: Subject, default: float, count: int) -> float:
    """Frames a second of those in use: a range that takes every n-th divides the rate. 0 for a single frame."""
    rate = subject.fps or default
    if not RATES[0] <= rate <= RATES[1]:
        raise UserError(
            "a frame rate that no capture has",
            file="params.yaml",
            place="fps",
            expected=f"{RATES[0]:g} to {RATES[1]:g} frames a second",
            found=f"{rate:g}",
            remedy="correct `fps` of this subject (of source actor: of `capture`) in params.yaml",
        )
    if count < 2:
        return 0.0
    step = subject.frames.step if isinstance(subject.frames, FrameRange) else 1
    return rate / step


def complete_subset(capture: Capture, cameras: Sequence[int]) -> tuple[list[int], list[int], list[Fact]]:
    """The cameras and frames between which no image is missing.

    A camera that lacks more than half of the frames is left out; of the frames, those stay that every other camera has.

    Args:
        cameras: indices of those to use.

    Returns:
        cameras, frames, and a fact for each one left out.
    """
    total = len(capture.frame_ids)
    lacks = {c: {f for f in range(total) if (c, f) not in capture.images} for c in cameras}
    name = {c: capture.views[c].name for c in cameras}
    kept = [c for c in cameras if 2 * len(lacks[c]) <= total]
    left_out = [
        fact("camera_incomplete", camera=name[c], has=total - len(lacks[c]), of=total) for c in cameras if c not in kept
    ]
    lacking = {f: [name[c] for c in kept if f in lacks[c]] for f in range(total)}
    left_out += [fact("frame_incomplete", frame=capture.frame_ids[f], cameras=of) for f, of in lacking.items() if of]
    frames = [f for f in range(total) if not lacking[f]]
    if not kept or not frames:
        worst = sorted((c for c in cameras if lacks[c]), key=lambda c: -len(lacks[c]))[:5]
        raise UserError(
            "no frame has an image from every camera",
            file=capture.root,
            expected=f"at least one of {total} frames complete",
            found="; ".join(f"{name[c]} lacks {len(lacks[c])}" for c in worst),
            remedy="add the missing images, or choose other frames for this subject in params.yaml",
        )
    return kept, frames, left_out


def check_image_sizes(capture: Capture, cameras: Sequence[int], frames: Sequence[int]) -> tuple[int, int]:
    """(width, height) of all images in use, from their headers (masks and mattes included)."""
    first = capture.images[cameras[0], frames[0]]
    expected = first.size(capture.place(cameras[0], frames[0]))
    for key in product(cameras, frames):
        for picture in [of[key] for of in (capture.images, capture.masks, capture.mattes) if key in of]:
            size = picture.size(capture.place(*key))
            if size != expected:
                words = f"{expected[0]} x {expected[1]}, as {first.file}"
                raise wrong_size(picture.file, capture.place(*key), size, words)
    for c in cameras:
        if c in capture.plates:
            check_plate_size(capture, c, capture.plates[c].size(capture.plate_place(c)))
    return expected


def check_plate_size(capture: Capture, camera: int, size: tuple[int, int]) -> None:
    """UserError unless a clean plate of `size` (width, height) has the shape of the camera's images.

    It may be larger or smaller, for both are averaged down; but not where a lens is taken out.
    """
    view = capture.views[camera]
    width, height = view.camera.width, view.camera.height
    if size == (width, height) or (view.lens is None and abs(size[0] * height / (size[1] * width) - 1) < 0.005):
        return
    file, expected = capture.plates[camera].file, f"{width} x {height}, as the camera's images"
    raise wrong_size(file, capture.plate_place(camera), size, expected)


def wrong_size(file: Path, place: str, size: tuple[int, int], expected: str) -> UserError:
    """The error for an image whose (width, height) is not that of the others."""
    return UserError(
        "images of different sizes",
        file=file,
        place=place,
        expected=expected,
        found=f"{size[0]} x {size[1]}",
        remedy="use cameras of one image size, or resize the images (and their intrinsics)",
    )


def closest_rotation(w2c: Array) -> Array:
    """(3, 4) [R | t] with R replaced by the nearest rotation: files store it with few digits."""
    u, _, vt = np.linalg.svd(w2c[:, :3])
    return np.concatenate([u @ vt, w2c[:, 3:]], 1)
