"""transforms.json of nerfstudio and instant-ngp.

Each entry of `frames` names an image and its camera -> world matrix with OpenGL axes (x right, y up, z backward).
Intrinsics (fl_x, fl_y, cx, cy, w, h, or camera_angle_x / camera_angle_y) and distortion (k1, k2, k3, p1, p2; of a
fisheye, that is where camera_model is OPENCV_FISHEYE or is_fisheye is true, k1 to k4) stand there or once at the top.
Pixel coordinates are continuous (the first pixel's centre at 0.5), as instant-ngp reads them.

A static capture has one image a camera. A dynamic one shows each camera, that is each matrix, several times: entries
differ by a `time` key, or by the folder or name of the image. Where every image was calibrated by itself the matrices
of a camera differ a little (`arrangement`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from facefolds_core.captures.arrangement import REMEDY, Shot, arrange, mean_calibration, wrong
from facefolds_core.captures.capture import Capture, closest_rotation, frame_rate, select_frames
from facefolds_core.captures.gathering import Calibration, Recognised, undistorted
from facefolds_core.captures.numbers import matrix_from, numbers_from, short
from facefolds_core.captures.picture import FilePicture, Picture
from facefolds_core.errors import UserError
from facefolds_core.facts import fact, shorten
from facefolds_core.files.reading import is_folder, is_regular, is_there
from facefolds_core.files.writing import read_json
from facefolds_core.geometry.cameras import HUGE, Array, Camera, check_camera, is_rotation
from facefolds_core.params import Subject

FPS = 30.0
PIXEL_CENTRES = 0.5
_PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE")
_DISTORTION = ("k1", "k2", "p1", "p2", "k3")
_FISHEYE = ("k1", "k2", "k3", "k4")
_KEYS = ("w", "h", "fl_x", "fl_y", "cx", "cy", "camera_angle_x", "camera_angle_y", "camera_model", "is_fisheye")
LATEST = 1e19
"""Of `time`: nanoseconds since 1970 are 1.8e18."""


@dataclass(frozen=True)
class Entry:
    """One entry of `frames`, with the global values filled in.

    Attributes:
        file, place: where it stands, for messages.
        label: its file_path.
        image: the file, which may be missing.
        values: the entry's keys over the global ones.
        w2c: (3, 4) world -> camera, OpenCV axes.
    """

    file: Path
    place: str
    label: str
    image: Path
    values: dict[str, Any]
    w2c: Array

    def number(self, key: str, default: float = 0.0) -> float:
        """The value of a key, or `default` where it is not there."""
        if key not in self.values:
            return default
        limit = LATEST if key == "time" else HUGE
        return float(numbers_from([self.values[key]], self.file, f"{self.place}, {key}", REMEDY, limit)[0])

    def wrong(self, message: str, expected: object, found: object, key: str = "", remedy: str = REMEDY) -> UserError:
        """The error for the entry, or for a key of it."""
        return wrong(self.file, f"{self.place}, {key}" if key else self.place, message, expected, found, remedy)


def recognise(root: Path) -> Recognised | None:
    """A folder with transforms.json, or such a file; where only transforms_train.json is there, that."""
    if is_regular(root):
        return Recognised("nerfstudio's or instant-ngp's cameras", root) if root.suffix == ".json" else None
    if is_there(root / "transforms.json"):
        return Recognised("a capture of nerfstudio or instant-ngp", root)
    parts = sorted(path for path in root.glob("transforms*.json") if is_regular(path)) if is_folder(root) else []
    if not parts:
        return None
    chosen = next((path for path in parts if "train" in path.name), parts[0])
    return Recognised(f"a capture of nerfstudio or instant-ngp in {len(parts)} parts", chosen)


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with transforms.json, or of that file."""
    path = root if root.suffix == ".json" and not is_folder(root) else root / "transforms.json"
    remedy = "point `path` at the folder that holds transforms.json, or make the file again"
    value = read_json(path, remedy=remedy)
    if not isinstance(value, dict) or not isinstance(value.get("frames"), list) or not value["frames"]:
        raise wrong(path, "top level", "no frames", "an object with a list `frames`", type(value).__name__)
    common = {key: entry for key, entry in value.items() if key != "frames"}
    entries = [_entry(e, common, path, f"frames[{i}]") for i, e in enumerate(value["frames"])]
    present = [e for e in entries if is_there(e.image)]
    left_out = [fact("image_missing", place=e.place, image=e.label) for e in entries if not is_there(e.image)]
    if not present:
        expected, remedy = f"{entries[0].label} beside transforms.json", "copy the images there, or correct file_path"
        raise wrong(path, "frames", "none of the images exists", expected, "no such file", remedy)
    arranged = arrange([_shot(entry) for entry in present], path)
    frames = select_frames(arranged.frames, subject.frames, path, f"`{path.name}`")
    centres = PIXEL_CENTRES if subject.pixel_centres is None else subject.pixel_centres
    members = {name: [present[i] for i in of] for name, of in arranged.cameras.items()}
    means = [mean_calibration(_calibrations(name, some, centres)) for name, some in members.items()]
    views = tuple(undistorted(one, one.K, one.w2c, one.size or (0, 0)) for one in means)
    position = {name: f for f, name in enumerate(frames)}
    images: dict[tuple[int, int], Picture] = {}
    for c, of in enumerate(arranged.cameras.values()):
        for i in of:
            if arranged.frame_of[i] in position:
                key = c, position[arranged.frame_of[i]]
                if key in images:
                    raise present[i].wrong("an image appears twice", "one entry a camera and frame", present[i].label)
                images[key] = FilePicture(present[i].image)
    rate = frame_rate(subject, FPS, len(frames))
    return Capture(path.parent, views, tuple(frames), rate, images, {}, None, tuple(left_out))


def _entry(value: Any, common: dict[str, Any], path: Path, place: str) -> Entry:
    if not isinstance(value, dict):
        expected = "{file_path, transform_matrix, ...}"
        raise wrong(path, place, "an entry that is no object", expected, type(value).__name__)
    label = value.get("file_path")
    if not isinstance(label, str) or not label:
        raise wrong(path, f"{place}, file_path", "a key is missing", "the path of an image", short(label))
    if "transform_matrix" not in value:
        raise wrong(path, f"{place} ({label}), transform_matrix", "a key is missing", "a 4 x 4 matrix", "nothing")
    place = f"{place} ({label})"
    return Entry(path, place, label, _find(path.parent, label), common | value, _w2c(value, path, place))


def _find(folder: Path, label: str) -> Path:
    """The image's file; instant-ngp also writes paths without extension."""
    candidates = [folder / f"{label}{suffix}" for suffix in ("", ".png", ".jpg", ".jpeg", ".JPG", ".PNG")]
    # What is there but no file (a FIFO, a folder, a broken link) is refused when it is opened, not taken for missing.
    there = [candidate for candidate in candidates if is_there(candidate)]
    return next((candidate for candidate in there if is_regular(candidate)), (there or candidates)[0])


def _w2c(value: dict[str, Any], path: Path, place: str) -> Array:
    """(3, 4) world -> camera with OpenCV axes, from camera -> world with OpenGL axes."""
    place = f"{place}, transform_matrix"
    c2w = matrix_from(value["transform_matrix"], ((4, 4), (3, 4)), path, place, REMEDY)
    if len(c2w) == 4 and not np.allclose(c2w[3], [0, 0, 0, 1]):
        raise wrong(path, place, "a camera matrix whose last row is not 0 0 0 1", "[0, 0, 0, 1]", c2w[3].tolist())
    rotation = c2w[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    if not is_rotation(rotation.T):
        expected, found = "orthonormal columns, determinant +1", f"det = {np.linalg.det(c2w[:3, :3]):.6g}"
        raise wrong(path, place, "a camera matrix is no rotation and translation", expected, found)
    inverse = closest_rotation(np.concatenate([rotation.T, np.zeros((3, 1))], 1))
    inverse[:, 3] = -inverse[:, :3] @ c2w[:3, 3]
    return inverse


def _shot(entry: Entry) -> Shot:
    path = PurePosixPath(entry.label)
    time = None if entry.values.get("time") is None else entry.number("time")
    return Shot(path.stem if entry.image.suffix == path.suffix else path.name, path.parent.name, time, entry.w2c)


def _calibrations(name: str, entries: list[Entry], pixel_centres: float) -> list[Calibration]:
    """Those of a camera's entries; one where all are the same, as they mostly are."""
    keys = (*_KEYS, *_DISTORTION, *_FISHEYE)
    given = {(np.round(e.w2c, 7).tobytes(), *(repr(e.values.get(key)) for key in keys)) for e in entries}
    return [_calibration(name, entry, pixel_centres) for entry in (entries if len(given) > 1 else entries[:1])]


def _calibration(name: str, entry: Entry, pixel_centres: float) -> Calibration:
    """Of one entry; K in continuous pixel coordinates."""
    width, height = FilePicture(entry.image).size(f"camera {name}")
    fisheye = _is_fisheye(entry)
    for key, size in (("w", width), ("h", height)):
        if entry.number(key, size) != size:
            message = "the image has another size than transforms.json says"
            found = f"{width} x {height} in {entry.image}"
            raise entry.wrong(message, entry.values[key], found, key, "use the images that the file was made for")
    fx, fy = _focal(entry, width, height)
    shift = 0.5 - pixel_centres
    cx, cy = entry.number("cx", width / 2 - shift) + shift, entry.number("cy", height / 2 - shift) + shift
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    check_camera(Camera(name, K, entry.w2c, width, height), entry.file, entry.place)
    given = [entry.number(key) for key in (_FISHEYE if fisheye else _DISTORTION)]
    return Calibration(name, K, entry.w2c, entry.file, entry.place, np.array(given), fisheye, (width, height))


def _is_fisheye(entry: Entry) -> bool:
    model = str(entry.values.get("camera_model", "OPENCV")).upper()
    fisheye = entry.values.get("is_fisheye", False)
    if not isinstance(fisheye, bool):
        raise entry.wrong("neither true nor false", "true or false", short(fisheye), "is_fisheye")
    if fisheye or model == "OPENCV_FISHEYE":
        return True
    fourth = entry.values.get("k4") is not None and entry.number("k4") != 0
    if model not in _PINHOLES or fourth:
        expected = f"OPENCV_FISHEYE, {shorten(_PINHOLES)}; k1 k2 p1 p2 k3 at most, of a fisheye k1 k2 k3 k4"
        found = "k4" if fourth else short(entry.values.get("camera_model"))
        raise entry.wrong("a camera model that is not read", expected, found, remedy="undistort the images first")
    return False


def _focal(entry: Entry, width: int, height: int) -> tuple[float, float]:
    """(fx, fy) in pixels, from fl_x / fl_y or the angles of view."""
    focal = {}
    for axis, size in (("x", width), ("y", height)):
        if f"fl_{axis}" in entry.values:
            focal[axis] = entry.number(f"fl_{axis}")
        elif f"camera_angle_{axis}" in entry.values:
            angle = entry.number(f"camera_angle_{axis}")
            if not 0 < angle < math.pi:
                raise entry.wrong(f"camera_angle_{axis} is no angle of view", "radians in (0, pi)", angle)
            focal[axis] = size / 2 / math.tan(angle / 2)
    if not focal:
        raise entry.wrong("no focal length", "fl_x (and fl_y) or camera_angle_x", "neither")
    fx = focal.get("x", focal.get("y", 0.0))
    return fx, focal.get("y", fx)
