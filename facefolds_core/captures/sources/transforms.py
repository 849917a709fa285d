"""transforms.json of nerfstudio and instant-ngp.

Each entry of `frames` names an image and its camera -> world matrix with OpenGL axes (x right, y up, z backward).
Intrinsics (fl_x, fl_y, cx, cy, w, h, or camera_angle_x / camera_angle_y) and distortion (k1, k2, k3, p1, p2) stand
there or once at the top. Pixel coordinates are continuous (the first pixel's centre at 0.5), as instant-ngp reads them.

A static capture has one image a camera. A dynamic one shows each camera, that is each matrix, several times: entries
differ by a `time` key, or by the folder or name of the image.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Capture, View, closest_rotation, frame_rate, select_frames
from facefolds_core.captures.images import image_size
from facefolds_core.captures.lens import make_lens
from facefolds_core.captures.picture import FilePicture, Picture
from facefolds_core.captures.values import json_matrix, json_number, short, wrong
from facefolds_core.facts import fact, shorten
from facefolds_core.files import read_json
from facefolds_core.geometry.cameras import HUGE, Camera, check_camera
from facefolds_core.params import CaptureParams, Subject
from facefolds_core.reading import LARGEST, check_regular, is_folder, is_regular, is_there

Array = NDArray[np.float64]

FPS = 30.0
PIXEL_CENTRES = 0.5
_PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE")
_DISTORTION = ("k1", "k2", "p1", "p2", "k3")
LATEST = 1e19
"""Of `time`: nanoseconds since 1970 are 1.8e18."""


@dataclass(frozen=True)
class Entry:
    """One entry of `frames`, with the global values filled in.

    Attributes:
        file, place: where it stands, for messages.
        label: its file_path.
        image: the file, or None where it is missing.
        values: the entry's keys over the global ones.
        w2c: (3, 4) world -> camera, OpenCV axes.
    """

    file: Path
    place: str
    label: str
    image: Path | None
    values: dict[str, Any]
    w2c: Array

    @property
    def time(self) -> float | None:
        return None if self.values.get("time") is None else _number(self, "time")


def _number(entry: Entry, key: str) -> float:
    limit = LATEST if key == "time" else HUGE
    return json_number(entry.values[key], entry.file, f"{entry.place}, {key}", limit)


def read(root: Path, subject: Subject, params: CaptureParams) -> Capture:
    """See `read_transforms`."""
    return read_transforms(root, subject)


def read_transforms(root: Path, subject: Subject) -> Capture:
    """Read everything but the pixels.

    Args:
        root: the folder with transforms.json, or that file.
        subject: its `frames`, `pixel_centres` and `fps` are used.

    Raises:
        UserError: if the file is missing, garbled, lacks a key or has a matrix that is none; names the entry and key.
    """
    path = root if root.suffix == ".json" and not is_folder(root) else root / "transforms.json"
    remedy = "point `path` at the folder that holds transforms.json, or make the file again"
    check_regular(path, remedy, largest=LARGEST)
    value = read_json(path, remedy=remedy)
    if not isinstance(value, dict) or not isinstance(value.get("frames"), list) or not value["frames"]:
        raise wrong(path, "top level", "no frames", "an object with a list `frames`", type(value).__name__)
    common = {key: entry for key, entry in value.items() if key != "frames"}
    entries = [_entry(e, common, path, f"frames[{i}]") for i, e in enumerate(value["frames"])]
    left_out = [fact("image_missing", place=e.place, image=e.label) for e in entries if e.image is None]
    present = [e for e in entries if e.image is not None]
    if not present:
        raise wrong(
            path,
            "frames",
            "none of the images exists",
            f"{entries[0].label} beside transforms.json",
            "no such file",
            "copy the images there, or correct file_path",
        )
    groups, names, frame_of = _arrange(present, path)
    what = f"`{path.name}`"
    frames = select_frames(names, subject.frames, path, what)
    centres = PIXEL_CENTRES if subject.pixel_centres is None else subject.pixel_centres
    views = tuple(_view(name, members[0], centres, path) for name, members in groups.items())
    position = {name: f for f, name in enumerate(frames)}
    images: dict[tuple[int, int], Picture] = {}
    for c, members in enumerate(groups.values()):
        for entry in members:
            name = frame_of[entry.place]
            if name in position and entry.image is not None:
                if (c, position[name]) in images:
                    raise wrong(
                        path, entry.place, "an image appears twice", "one entry a camera and frame", entry.label
                    )
                images[c, position[name]] = FilePicture(entry.image)
    rate = frame_rate(subject, FPS, len(frames))
    return Capture(path.parent, views, tuple(frames), rate, images, {}, None, tuple(left_out))


def _entry(value: Any, common: dict[str, Any], path: Path, place: str) -> Entry:
    if not isinstance(value, dict):
        raise wrong(
            path, place, "an entry that is no object", "{file_path, transform_matrix, ...}", type(value).__name__
        )
    label = value.get("file_path")
    if not isinstance(label, str) or not label:
        raise wrong(path, f"{place}, file_path", "a key is missing", "the path of an image", short(label))
    if "transform_matrix" not in value:
        raise wrong(path, f"{place} ({label}), transform_matrix", "a key is missing", "a 4 x 4 matrix", "nothing")
    place = f"{place} ({label})"
    return Entry(path, place, label, _find(path.parent, label), common | value, _w2c(value, path, place))


def _find(folder: Path, label: str) -> Path | None:
    """The image's file; instant-ngp also writes paths without extension."""
    candidates = [folder / label] + [
        folder / f"{label}{suffix}" for suffix in (".png", ".jpg", ".jpeg", ".JPG", ".PNG")
    ]
    found = [candidate for candidate in candidates if is_regular(candidate)]
    # What is there but no file (a FIFO, a folder, a broken link) is refused when it is opened, not taken for missing.
    return next(iter(found), None) or next((candidate for candidate in candidates if is_there(candidate)), None)


def _w2c(value: dict[str, Any], path: Path, place: str) -> Array:
    """(3, 4) world -> camera with OpenCV axes, from camera -> world with OpenGL axes."""
    place = f"{place}, transform_matrix"
    c2w = json_matrix(value["transform_matrix"], path, place)
    rotation = c2w[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
        raise wrong(
            path,
            place,
            "a camera matrix is no rotation and translation",
            "orthonormal columns, determinant +1",
            f"det = {np.linalg.det(c2w[:3, :3]):.6g}",
        )
    inverse = closest_rotation(np.concatenate([rotation.T, np.zeros((3, 1))], 1))
    inverse[:, 3] = -inverse[:, :3] @ c2w[:3, 3]
    return inverse


def _arrange(entries: list[Entry], path: Path) -> tuple[dict[str, list[Entry]], list[str], dict[str, str]]:
    """Sort entries into cameras and frames.

    Returns:
        camera name -> entries; names of the frames, in order; place of an entry -> name of its frame.
    """
    by_pose: dict[bytes, list[Entry]] = defaultdict(list)
    for entry in entries:
        by_pose[np.round(entry.w2c, 7).tobytes()].append(entry)
    groups = list(by_pose.values())
    times = {entry.time for entry in entries}
    if max(len(group) for group in groups) == 1:
        if len(times) > 1:
            raise wrong(
                path,
                "time",
                "every camera is seen at one time only, as from a single moving camera",
                "cameras that see every frame",
                f"{len(groups)} cameras, {len(times)} times",
                "use a capture of several fixed cameras; for a static scene, take the `time` keys out",
            )
        names = _unique([_stem_and_folder(group[0]) for group in groups])
        return dict(zip(names, groups, strict=True)), ["0"], {entry.place: "0" for entry in entries}
    timed = None not in times
    named = _time_names([time for time in times if time is not None]) if timed else {}
    frame_of = {}
    stems = _frame_is_folder(groups)
    for entry in entries:
        stem, folder = _stem_and_folder(entry)
        frame_of[entry.place] = folder if stems else stem
        if timed and entry.time is not None:
            frame_of[entry.place] = named[entry.time]
    ordered = list(named.values()) if timed else sorted(set(frame_of.values()))
    parts = [_stem_and_folder(group[0]) for group in groups]
    cameras = _unique([(stem, folder) if stems else (folder, stem) for stem, folder in parts])
    return dict(zip(cameras, groups, strict=True)), ordered, frame_of


def _time_names(times: Iterable[float]) -> dict[float, str]:
    """Names of moments, in order: six digits, or all of them where six are not enough to tell them apart."""
    ordered = sorted(set(times))
    short = [f"{time:g}" for time in ordered]
    return dict(zip(ordered, short if len(set(short)) == len(short) else map(repr, ordered), strict=True))


def _stem_and_folder(entry: Entry) -> tuple[str, str]:
    path = PurePosixPath(entry.label)
    name = path.name if entry.image is None or entry.image.suffix != path.suffix else path.stem
    return name, path.parent.name


def _frame_is_folder(groups: list[list[Entry]]) -> bool:
    """Whether the images of one camera share their name (so that folders are frames) or their folder."""
    return all(len({_stem_and_folder(entry)[0] for entry in group}) == 1 for group in groups)


def _unique(candidates: list[tuple[str, str]]) -> list[str]:
    """Names of cameras: the first choice of each where these differ, else the second, else both, else numbered."""
    for names in (
        [first for first, _ in candidates],
        [second for _, second in candidates],
        [f"{second}/{first}" for first, second in candidates],
    ):
        if max(Counter(names).values()) == 1:
            return names
    return [f"{first}-{i}" for i, (first, _) in enumerate(candidates)]


def _view(name: str, entry: Entry, pixel_centres: float, path: Path) -> View:
    """The camera of an entry, distortion taken out."""
    assert entry.image is not None
    width, height = image_size(entry.image, f"camera {name}")
    _check_model(entry, path)
    for key, size in (("w", width), ("h", height)):
        if key in entry.values and _number(entry, key) != size:
            raise wrong(
                path,
                f"{entry.place}, {key}",
                "the image has another size than transforms.json says",
                entry.values[key],
                f"{width} x {height} in {entry.image}",
                "use the images that the file was made for",
            )
    fx, fy = _focal(entry, width, height, path)
    shift = 0.5 - pixel_centres
    cx = _number(entry, "cx") + shift if "cx" in entry.values else width / 2
    cy = _number(entry, "cy") + shift if "cy" in entry.values else height / 2
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    check_camera(Camera(name, K, entry.w2c, width, height), path, entry.place)
    coefficients = np.array([_number(entry, key) if key in entry.values else 0.0 for key in _DISTORTION])
    lens = make_lens(K, coefficients, width, height, path, entry.place)
    return View(Camera(name, K if lens is None else lens.pinhole, entry.w2c, width, height), lens)


def _check_model(entry: Entry, path: Path) -> None:
    model = entry.values.get("camera_model", "OPENCV")
    fisheye = entry.values.get("is_fisheye", False)
    if not isinstance(fisheye, bool):
        raise wrong(path, f"{entry.place}, is_fisheye", "neither true nor false", "true or false", short(fisheye))
    fisheye = fisheye or (entry.values.get("k4") is not None and _number(entry, "k4") != 0)
    if str(model).upper() not in _PINHOLES or fisheye:
        raise wrong(
            path,
            entry.place,
            "a camera model that is not read",
            f"{shorten(_PINHOLES)}, k1 k2 p1 p2 k3 at most",
            "k4 or is_fisheye" if fisheye else short(model),
            "rectify the images first",
        )


def _focal(entry: Entry, width: int, height: int, path: Path) -> tuple[float, float]:
    """(fx, fy) in pixels, from fl_x / fl_y or the angles of view."""
    values = entry.values
    focal = {}
    for axis, size in (("x", width), ("y", height)):
        if f"fl_{axis}" in values:
            focal[axis] = _number(entry, f"fl_{axis}")
        elif f"camera_angle_{axis}" in values:
            angle = _number(entry, f"camera_angle_{axis}")
            if not 0 < angle < math.pi:
                raise wrong(path, entry.place, f"camera_angle_{axis} is no angle of view", "radians in (0, pi)", angle)
            focal[axis] = size / 2 / math.tan(angle / 2)
    if not focal:
        raise wrong(path, entry.place, "no focal length", "fl_x (and fl_y) or camera_angle_x", "neither")
    fx = focal.get("x", focal.get("y", 0.0))
    return fx, focal.get("y", fx)
