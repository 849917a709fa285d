"""COLMAP: a sparse model and the pictures that it registered, of a still scene or of a rig that films.

    sparse/0/cameras.bin|.txt  images.bin|.txt      or in `path` itself
    images/CAM/000000.jpg                           a folder a camera: a film; all its pictures are used
    images/00001.jpg                                else each picture is a camera of a still scene

A rig is often registered by its first pictures only, `CAM.jpg` or `CAM/000000.jpg`: where there is a folder images/CAM,
all pictures in it have that camera's pose. Where every picture of a folder was registered, their poses differ a little;
the mean of a camera is used.

World to camera, quaternion w, x, y, z, OpenCV's axes. Formats, of the text and of the binary files, and the parameters
of each camera model: colmap/colmap, scripts/python/read_write_model.py, and https://colmap.github.io/format.html (the
corner of the first pixel is (0, 0), its centre (0.5, 0.5)). Points are skipped. pycolmap is not needed: it is a large
binary, and the formats are small.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from facefolds_core.captures.arrangement import Shot, arrange, mean_calibration
from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import Calibration, Recognised, gather, inside, pictures_in
from facefolds_core.captures.picture import FilePicture, Picture
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.files.reading import is_folder, is_regular, is_there, read_bytes, read_text
from facefolds_core.geometry.cameras import HUGE, Array
from facefolds_core.geometry.quaternions import rotation
from facefolds_core.params import Subject

FPS = 30.0
PIXEL_CENTRES = 0.5
MODELS = {
    0: ("SIMPLE_PINHOLE", 3), 1: ("PINHOLE", 4), 2: ("SIMPLE_RADIAL", 4), 3: ("RADIAL", 5), 4: ("OPENCV", 8),
    5: ("OPENCV_FISHEYE", 8), 6: ("FULL_OPENCV", 12), 7: ("FOV", 5), 8: ("SIMPLE_RADIAL_FISHEYE", 4),
    9: ("RADIAL_FISHEYE", 5), 10: ("THIN_PRISM_FISHEYE", 12), 11: ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
}  # fmt: skip
"""Number in binary files -> name, count of parameters."""
ONE_FOCAL = ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE")
"""Their parameters begin with f, cx, cy; those of the others with fx, fy, cx, cy."""
UNREAD = ("FOV", "THIN_PRISM_FISHEYE", "RAD_TAN_THIN_PRISM_FISHEYE")
_REMEDY = "write the model again (`colmap model_converter`)"

Photos = dict[str, dict[str, Picture]]
Row = tuple[int, str, tuple[int, int], list[float], str]
"""Of a camera: its number, model, (width, height), parameters, and where it stands."""
Posed = tuple[str, int, list[float], str]
"""Of an image: its name, its camera's number, its pose, and where it stands."""


def recognise(root: Path) -> Recognised | None:
    """A folder with a sparse model, below it or in it."""
    folder = model_folder(root)
    if folder is None:
        return None
    return Recognised("a COLMAP model" if folder == root else f"a COLMAP model, in {folder.relative_to(root)}", root)


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with sparse and images."""
    folder = model_folder(root)
    if folder is None:
        raise UserError(
            "no COLMAP model",
            file=root,
            expected="cameras and images (.bin or .txt) in sparse/0, sparse or the folder itself",
            remedy="point `path` at the folder that holds sparse and images",
        )
    images, file = read_model(folder)
    near = (root / "images", folder / "images", folder.parent.parent / "images")
    pictures = next((place for place in near if is_folder(place)), root)
    films = _films(images, pictures)
    if films is None:
        groups, photos, left_out = _registered(images, pictures, file)
    else:
        groups = {name: [image] for name, (image, _) in films.items()}
        photos, left_out = {name: pictures_in(place) for name, (_, place) in films.items()}, []
    each = [[replace(i, name=name, place=f"{i.place} ({i.name})") for i in of] for name, of in groups.items()]
    left_out += _other_models(folder)
    means = [mean_calibration(some) for some in each]
    return gather(root, means, photos, subject, fps=FPS, pixel_centres=PIXEL_CENTRES, left_out=left_out)


def _films(images: list[Calibration], pictures: Path) -> dict[str, tuple[Calibration, Path]] | None:
    """Camera -> its one registered picture and the folder of its film; None unless every picture has one of its own."""
    found = {}
    for image in images:
        path = PurePosixPath(image.name)
        folders = [pictures / path.with_suffix("")] + ([pictures / path.parent] if path.parent.name else [])
        film = next((folder for folder in folders if len(pictures_in(folder)) > 1), None)
        if film is None or film.name in found:
            return None
        found[film.name] = image, film
    return found


def _registered(
    images: list[Calibration], pictures: Path, file: Path
) -> tuple[dict[str, list[Calibration]], Photos, list[Fact]]:
    """Cameras with their registered pictures, the pictures by frame, and facts on those that are missing.

    Of a camera that has a folder of its own, pictures count that were not registered, too.
    """
    paths = {image.name: _find(pictures, image.name) for image in images}
    facts = [fact("image_missing", place=f"{file.name}, {i.place}", image=i.name) for i in images if not paths[i.name]]
    images = [image for image in images if paths[image.name]]
    if not images:
        raise UserError(
            "none of the registered pictures exists",
            file=pictures,
            expected=next(iter(paths)),
            found="no such file",
            remedy="put the pictures that COLMAP saw into the folder images",
        )
    paths_there = [PurePosixPath(image.name) for image in images]
    shots = [Shot(p.stem, p.parent.name, None, image.w2c) for p, image in zip(paths_there, images, strict=True)]
    arranged = arrange(shots, file)
    groups = {name: [images[i] for i in of] for name, of in arranged.cameras.items()}
    photos: Photos = {}
    for name, of in arranged.cameras.items():
        own = paths_there[of[0]].parent
        if len(of) > 1 and own.name == name:
            photos[name] = pictures_in(pictures / own)
        else:
            photos[name] = {arranged.frame_of[i]: FilePicture(pictures / images[i].name) for i in of}
    return groups, photos, facts


def _find(pictures: Path, name: str) -> bool:
    """Whether a registered picture is there; names that lead out of the folder are none."""
    path = PurePosixPath(name)
    return ".." not in path.parts and not path.is_absolute() and is_there(pictures / name)


def _other_models(folder: Path) -> list[Fact]:
    """A note where COLMAP found several models that do not hang together."""
    if folder.name != "0":
        return []
    others = [path.name for path in inside(folder.parent) if path.name != "0" and model_folder(path) == path]
    return [fact("other_models", others=others)] if others else []


def model_folder(root: Path) -> Path | None:
    """Where cameras and images of a model lie: in `root`, or where COLMAP's own tools put them below it."""
    for folder in (root, root / "sparse" / "0", root / "sparse", root / "colmap" / "sparse" / "0"):
        if any(all(is_regular(folder / f"{n}.{kind}") for n in ("cameras", "images")) for kind in ("bin", "txt")):
            return folder
    return None


def read_model(folder: Path) -> tuple[list[Calibration], Path]:
    """The registered images, by the order of their names, each with its camera, and the images' file."""
    kind = "bin" if is_regular(folder / "cameras.bin") and is_regular(folder / "images.bin") else "txt"
    first, second = folder / f"cameras.{kind}", folder / f"images.{kind}"
    rows = _cameras_bin(first) if kind == "bin" else _cameras_txt(first)
    cameras = {number: _camera(name, size, values, first, place) for number, name, size, values, place in rows}
    posed = _images_bin(second) if kind == "bin" else _images_txt(second)
    images = []
    for name, number, pose, place in posed:
        w2c = _w2c(pose, second, place)
        if number not in cameras:
            expected, found = f"one of {first.name}", f"camera {number}"
            raise _wrong(second, place, "an image of a camera that is not there", expected, found)
        images.append(replace(cameras[number], name=name, w2c=w2c, file=second, place=place))
    if not images:
        raise _wrong(second, None, "no image is registered", "images with poses", "none")
    return sorted(images, key=lambda image: image.name), second


def _wrong(file: Path, place: str | None, message: str, expected: object, found: object) -> UserError:
    return UserError(message, file=file, place=place, expected=expected, found=found, remedy=_REMEDY)


def _camera(name: str, size: tuple[int, int], values: list[float], file: Path, place: str) -> Calibration:
    """A camera of the model `name`, at the origin."""
    counts = dict(MODELS.values())
    if name not in counts or name in UNREAD:
        read = ", ".join(model for model in counts if model not in UNREAD)
        raise UserError(
            "a camera model that is not read",
            file=file,
            place=place,
            expected=read,
            found=name,
            remedy="undistort with COLMAP first (`colmap image_undistorter`) and point `path` at what it writes",
        )
    if len(values) != counts[name] or not (np.abs(values) <= HUGE).all() or not 1 <= min(size) <= max(size) < 1 << 20:
        expected = f"width, height and {counts[name]} finite numbers of {name}"
        raise _wrong(file, place, "a garbled camera", expected, f"{size[0]} x {size[1]}, {values}")
    focal, rest = (values[:1] * 2, values[1:]) if name in ONE_FOCAL else (values[:2], values[2:])
    K = np.array([[focal[0], 0, rest[0]], [0, focal[1], rest[1]], [0, 0, 1]])
    # All but FULL_OPENCV lack the last of OpenCV's coefficients; FULL_OPENCV has k1 k2 p1 p2 k3 k4 k5 k6, as `Lens`.
    return Calibration(name, K, np.eye(3, 4), file, place, np.array(rest[2:]), name.endswith("FISHEYE"), size)


def _w2c(pose: list[float], file: Path, place: str) -> Array:
    """(3, 4) from a quaternion w, x, y, z and a translation."""
    q, t = np.array(pose[:4]), np.array(pose[4:])
    length = np.linalg.norm(np.where(np.abs(q) <= HUGE, q, np.inf))
    if not (np.abs(pose) <= HUGE).all() or not 0.5 < length < 2:
        raise _wrong(file, place, "a garbled pose", "a quaternion of length 1 and a translation", pose)
    return np.concatenate([rotation(q / length), t[:, None]], 1)


def _cameras_txt(file: Path) -> Iterator[Row]:
    for number, line in enumerate(read_text(file, _REMEDY, expected=file.name).splitlines(), 1):
        if line.strip() and not line.startswith("#"):
            place, parts = f"line {number}", line.split()
            try:
                size = (int(parts[2]), int(parts[3]))
                yield int(parts[0]), parts[1], size, [float(part) for part in parts[4:]], place
            except (ValueError, IndexError):
                raise _wrong(file, place, "a garbled camera", "number, model, width, height, numbers", line) from None


def _images_txt(file: Path) -> Iterator[Posed]:
    """Every second line lists an image's points; it may be empty, and is skipped."""
    points = False
    for number, line in enumerate(read_text(file, _REMEDY, expected=file.name).splitlines(), 1):
        if points:
            points = False
        elif line.strip() and not line.startswith("#"):
            parts, points = line.strip().split(maxsplit=9), True
            try:
                yield parts[9], int(parts[8]), [float(part) for part in parts[1:8]], f"line {number}"
            except (ValueError, IndexError):
                expected = "number, qw, qx, qy, qz, tx, ty, tz, camera, name"
                raise _wrong(file, f"line {number}", "a garbled image", expected, line[:200]) from None


class _Bytes:
    """A binary file, read from its beginning."""

    def __init__(self, file: Path) -> None:
        self.file, self.data, self.at = file, read_bytes(file, _REMEDY), 0

    def skip(self, size: int) -> int:
        """Where the next `size` bytes lie, which are passed over."""
        start, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise _wrong(self.file, f"byte {start}", "cut off, or garbled", "more bytes", f"{len(self.data)} bytes")
        return start

    def take(self, form: str) -> tuple[float, ...]:
        return struct.unpack_from("<" + form, self.data, self.skip(struct.calcsize("<" + form)))

    def name(self) -> str:
        end = self.data.find(b"\0", self.at)
        start = self.skip((end if end >= 0 else len(self.data)) + 1 - self.at)
        try:
            return self.data[start:end].decode()
        except UnicodeDecodeError:
            raise _wrong(self.file, f"byte {start}", "a garbled name", "UTF-8", "other bytes") from None


def _entries(file: Path) -> Iterator[tuple[_Bytes, str]]:
    """For each entry of a binary file the file, which stands at it, and the entry's place."""
    data = _Bytes(file)
    (count,) = data.take("Q")
    for _ in range(int(count)):
        yield data, f"byte {data.at}"


def _cameras_bin(file: Path) -> Iterator[Row]:
    for data, place in _entries(file):
        number, model, width, height = (int(value) for value in data.take("iiQQ"))
        name, parameters = MODELS.get(model, (f"number {model}", 0))
        yield number, name, (width, height), list(data.take("d" * parameters)), place


def _images_bin(file: Path) -> Iterator[Posed]:
    for data, place in _entries(file):
        values, name = data.take("idddddddi"), data.name()
        (points,) = data.take("Q")
        data.skip(24 * int(points))
        yield name, int(values[8]), list(values[1:8]), place
