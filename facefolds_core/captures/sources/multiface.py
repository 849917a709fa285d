"""Multiface captures, v1 and v2 (and the embedded actor, which is written in the same layout).

    KRT  frame_list.txt
    images/SEGMENT/CAMERA/FRAME.png
    tracked_mesh/SEGMENT/FRAME.obj|.bin|_transform.txt
    masks/SEGMENT/CAMERA/FRAME.png          not in Multiface: true opacity, where a synthetic capture knows it
    mattes/SEGMENT/CAMERA/FRAME.png         not in Multiface: opacity of any camera, which training may use
    plates/CAMERA.png                       not in Multiface: the same camera without the subject

Cameras, frames or images may be missing; what is not used is named in `Capture.left_out`.

KRT has eight lines a camera: its name; the three rows of K; five distortion values (k1 k2 p1 p2 k3); the three rows of
[R | t], world -> camera with OpenCV axes, millimetres. Blank lines separate cameras. K refers to full-size images
(1334 x 2048) in the dataset, but copies with reduced images carry either that K or a scaled one: `krt_reference`.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from facefolds_core.captures.capture import Capture, Sound, View, closest_rotation, frame_rate, select_frames
from facefolds_core.captures.gathering import (
    Calibration,
    Recognised,
    cameras_with_pictures,
    chosen_segment,
    first_sizes,
    inside,
    pictures_in,
    placed,
    scaled_intrinsics,
    undistorted,
)
from facefolds_core.captures.picture import Picture
from facefolds_core.captures.tracked import read_tracking
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.reading import check_folder, is_folder, is_regular, is_there, read_text
from facefolds_core.geometry.cameras import HUGE, Camera, check_camera
from facefolds_core.params import Subject

FPS = 30.0
PNG = (".png",)
PIXEL_CENTRES = 0.0
"""OpenCV's calibration, from which Multiface's KRT comes, puts the centre of the first pixel at 0."""
FULL_SIZE = (1334, 2048)
"""(width, height) of Multiface's own images, v1 and v2."""
OFF_CENTRE = 0.25
"""Of the image's size: a principal point that is farther from the middle is not near it. K of half the size puts it so
far off, K of twice the size twice as far."""
_ROWS = (3, 3, 3, 5, 4, 4, 4)
"""Numbers in the lines of a camera of KRT, behind its name."""
_REMEDY = "copy KRT again from the dataset, or mend this line"
_wrong = partial(UserError, remedy=_REMEDY)


def recognise(root: Path) -> Recognised | None:
    """A folder with KRT, or with so much beside it that KRT is what is missing."""
    rest = is_folder(root / "images") and (is_folder(root / "tracked_mesh") or is_there(root / "frame_list.txt"))
    if not rest and not is_there(root / "KRT"):
        return None
    segments = [path.name for path in inside(root / "images") if path.is_dir()]
    if len(segments) < 2:
        return Recognised("a Multiface subject", root)
    return Recognised(f"a Multiface subject, segments {shorten(segments)}", root, {"segment": segments[0]})


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with KRT; `segment`, `frames`, `krt_size`, `pixel_centres` and `fps` of the subject are used."""
    calibration = read_krt(root / "KRT")
    segment = _segment(root, subject.segment)
    photos, masks, mattes = (_pictures(root / kind / segment) for kind in ("images", "masks", "mattes"))
    used, left_out = cameras_with_pictures(calibration, photos, root, krt=True)
    names = sorted({frame for camera in used for frame in photos[camera.name]})
    listed = _listed(root / "frame_list.txt", segment)
    left_out += [fact("frame_without_images", frame=name) for name in listed if name not in names]
    frames = select_frames(names, subject.frames, root / "images" / segment, f"segment {segment}")
    tracking, frames, facts = read_tracking(root / "tracked_mesh" / segment, frames)
    left_out += facts
    views, notes = _views(used, photos, root, subject)
    cameras = [view.name for view in views]
    images = placed(photos, cameras, frames)
    plates = pictures_in(root / "plates", PNG)
    audio = root / "audio" / f"{segment}.wav"
    rate = frame_rate(subject, FPS, len(frames))
    seconds = tuple(names.index(name) / (subject.fps or FPS) for name in frames)
    return Capture(
        root,
        views,
        tuple(frames),
        rate,
        images,
        {key: mask for key, mask in placed(masks, cameras, frames).items() if key in images},
        tracking,
        (*left_out, *notes),
        Sound(audio, seconds) if is_there(audio) else None,
        {c: plates[name] for c, name in enumerate(cameras) if name in plates},
        {key: matte for key, matte in placed(mattes, cameras, frames).items() if key in images},
    )


def _segment(root: Path, wanted: str | None) -> str:
    folder = root / "images"
    for place in (root, folder):
        check_folder(place, "point `path` at a Multiface subject's folder, which holds KRT and images")
    segments = [path.name for path in inside(folder) if path.is_dir()]
    return chosen_segment(segments, wanted, folder, "download some: images/SEGMENT/CAMERA/FRAME.png")


def _pictures(folder: Path) -> dict[str, dict[str, Picture]]:
    """Camera -> frame -> file, of what is there."""
    return {camera.name: pictures_in(camera, PNG) for camera in inside(folder) if camera.is_dir()}


def _listed(path: Path, segment: str) -> list[str]:
    """Frames of a segment in frame_list.txt, which is not needed and may be missing."""
    if not is_there(path):
        return []
    text = read_text(
        path, "copy it again from the dataset, or remove it: it may be missing", expected="a list of frames"
    )
    pairs = [line.split() for line in text.splitlines()]
    return [pair[1] for pair in pairs if len(pair) == 2 and pair[0] == segment]


def _views(
    used: list[Calibration], photos: dict[str, dict[str, Picture]], root: Path, subject: Subject
) -> tuple[tuple[View, ...], list[Fact]]:
    """Cameras for the images at hand, and a note on the size that KRT refers to."""
    sizes, common = first_sizes(used, photos)
    reference, notes = krt_reference(used, common, subject.krt_size, root / "KRT")
    centres = PIXEL_CENTRES if subject.pixel_centres is None else subject.pixel_centres
    views = []
    for one in used:
        K = scaled_intrinsics(one.K, reference, sizes[one.name], centres)
        views.append(undistorted(one, K, closest_rotation(one.w2c), sizes[one.name]))
    return tuple(views), notes


def _numbers(text: str, count: int, path: Path, place: str) -> list[float]:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not (np.abs(values) <= HUGE).all() or "_" in text:
        raise _wrong("garbled KRT", file=path, place=place, expected=f"{count} numbers", found=repr(text)[:200])
    return values


def read_krt(path: Path) -> list[Calibration]:
    """All cameras of a KRT file, in its order."""
    here = "point `path` at a Multiface subject's folder, which holds KRT"
    text = read_text(path, _REMEDY if is_regular(path) else here, expected="KRT")
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    cameras: list[Calibration] = []
    for first in range(0, len(lines), 8):
        block = lines[first : first + 8]
        cameras.append(_camera(block, path))
    if not cameras:
        raise _wrong("KRT is empty", file=path, expected="at least one camera")
    return cameras


def _camera(block: list[tuple[int, str]], path: Path) -> Calibration:
    """Parse the lines [(number, text)] of one camera."""
    number, name = block[0]
    if len(name.split()) != 1:
        expected = "the name of a camera"
        raise _wrong("garbled KRT", file=path, place=f"line {number}", expected=expected, found=repr(name)[:200])
    rows = [
        _numbers(text, count, path, f"line {line} (camera {name})")
        for (line, text), count in zip(block[1:], _ROWS, strict=False)
    ]
    if len(rows) < len(_ROWS):
        raise _wrong(
            "KRT is truncated",
            file=path,
            place=f"line {block[-1][0]}, the last one (camera {name})",
            expected="8 lines a camera",
            found=f"{len(block)} lines",
        )
    place = f"camera {name}, lines {number} to {block[-1][0]}"
    camera = Calibration(name, np.array(rows[0:3]), np.array(rows[4:7]), path, place, np.array(rows[3]))
    check_camera(Camera(name, camera.K, camera.w2c, 1, 1), path, place)
    return camera


def krt_reference(
    cameras: list[Calibration], image: tuple[int, int], given: tuple[int, int] | None, path: Path
) -> tuple[tuple[int, int], list[Fact]]:
    """Find out which image size K refers to.

    Two hypotheses: the images at hand, or the dataset's full size. A principal point lies near the middle of the image,
    so the one with the smaller median distance |c / size - 1/2| holds, if that is under `OFF_CENTRE`.

    Args:
        image: (width, height) of most images at hand.
        given: `krt_size` of params.yaml, which overrides.

    Returns:
        (width, height), and a fact on what was found out, if anything.
    """
    if given is not None:
        return given, []
    if image == FULL_SIZE:
        return image, []
    points = np.median([camera.K[:2, 2] for camera in cameras], axis=0)
    offsets = {size: float(np.abs(points / size - 0.5).max()) for size in (image, FULL_SIZE)}
    best = min(offsets, key=offsets.__getitem__)
    words = f"median principal point ({points[0]:.1f}, {points[1]:.1f})"
    if offsets[best] > OFF_CENTRE:
        raise UserError(
            "cannot tell which image size KRT refers to",
            file=path,
            expected=f"principal points near the middle of {image[0]} x {image[1]} or {FULL_SIZE[0]} x {FULL_SIZE[1]}",
            found=words,
            remedy="set `krt_size: [width, height]` of this subject in params.yaml",
        )
    kind = "krt_is_scaled" if best == image else "krt_is_of_full_size"
    return best, [fact(kind, point=[float(x) for x in points], image=list(image))]
