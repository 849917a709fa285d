"""Multiface captures, v1 and v2 (and the embedded actor, which is written in the same layout).

    KRT  frame_list.txt
    images/SEGMENT/CAMERA/FRAME.png
    tracked_mesh/SEGMENT/FRAME.obj|.bin|_transform.txt
    masks/SEGMENT/CAMERA/FRAME.png          not in Multiface: true opacity, where a synthetic capture knows it
    mattes/SEGMENT/CAMERA/FRAME.png         not in Multiface: opacity of any camera, which training may use
    plates/CAMERA.png                       not in Multiface: the same camera without the subject

Cameras, frames or images may be missing; what is not used is named in `Capture.left_out`.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from facefolds_core.captures.capture import Capture, Sound, View, closest_rotation, frame_rate, select_frames
from facefolds_core.captures.gathering import (
    Calibration,
    Recognised,
    cameras_with_pictures,
    chosen_segment,
    inside,
    scaled_intrinsics,
)
from facefolds_core.captures.images import image_size
from facefolds_core.captures.krt import krt_reference, read_krt
from facefolds_core.captures.lens import make_lens
from facefolds_core.captures.picture import FilePicture, Picture
from facefolds_core.captures.tracked import read_tracking
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.reading import check_folder, is_folder, is_there, read_text
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams, Subject

FPS = 30.0
PIXEL_CENTRES = 0.0
"""OpenCV's calibration, from which Multiface's KRT comes, puts the centre of the first pixel at 0."""


def recognise(root: Path) -> Recognised | None:
    """A folder with KRT, or with so much beside it that KRT is what is missing."""
    rest = is_folder(root / "images") and (is_folder(root / "tracked_mesh") or is_there(root / "frame_list.txt"))
    if not rest and not is_there(root / "KRT"):
        return None
    segments = [path.name for path in inside(root / "images") if path.is_dir()] if is_folder(root / "images") else []
    if len(segments) < 2:
        return Recognised("a Multiface subject", root)
    return Recognised(f"a Multiface subject, segments {shorten(segments)}", root, {"segment": segments[0]})


def read(root: Path, subject: Subject, params: CaptureParams) -> Capture:
    """As `read_multiface`, at Multiface's rate."""
    return read_multiface(root, subject)


def read_multiface(root: Path, subject: Subject, fps: float = FPS) -> Capture:
    """Read everything but the pixels.

    Args:
        root: folder with KRT.
        subject: its `segment`, `frames`, `krt_size`, `pixel_centres` and `fps` are used.
        fps: where the subject leaves it null.

    Raises:
        UserError: for a file that is missing or damaged, and a segment or frame that does not exist.
    """
    calibration = read_krt(root / "KRT")
    segment = _segment(root, subject.segment)
    photos = _photos(root / "images" / segment)
    used, bare, strange = cameras_with_pictures(calibration, photos, root)
    left_out = [fact("camera_without_images", camera=name) for name in bare]
    left_out += [fact("camera_without_calibration", camera=name) for name in strange]
    names = sorted({frame for camera in used for frame in photos[camera.name]})
    listed = _listed(root / "frame_list.txt", segment)
    left_out += [fact("frame_without_images", frame=name) for name in listed if name not in names]
    frames = select_frames(names, subject.frames, root / "images" / segment, f"segment {segment}")
    tracking, frames, facts = read_tracking(root / "tracked_mesh" / segment, frames)
    left_out += facts
    views, note = _views(used, photos, root, subject)
    left_out += [note] if note else []
    images = {
        (c, f): FilePicture(photos[view.name][name])
        for c, view in enumerate(views)
        for f, name in enumerate(frames)
        if name in photos[view.name]
    }

    def opacity(folder: str) -> dict[tuple[int, int], Picture]:
        return {
            (c, f): FilePicture(path)
            for c, f in images
            if is_there(path := root / folder / segment / views[c].name / f"{frames[f]}.png")
        }

    plates = {c: path for c, view in enumerate(views) if is_there(path := root / "plates" / f"{view.name}.png")}
    audio = root / "audio" / f"{segment}.wav"
    rate = frame_rate(subject, fps, len(frames))
    seconds = tuple(names.index(name) / (subject.fps or fps) for name in frames)
    return Capture(
        root,
        views,
        tuple(frames),
        rate,
        images,
        opacity("masks"),
        tracking,
        tuple(left_out),
        Sound(audio, seconds) if is_there(audio) else None,
        {c: FilePicture(path) for c, path in plates.items()},
        opacity("mattes"),
    )


def _segment(root: Path, wanted: str | None) -> str:
    folder = root / "images"
    for place in (root, folder):
        check_folder(place, "point `path` at a Multiface subject's folder, which holds KRT and images")
    segments = [path.name for path in inside(folder) if path.is_dir()] if folder.is_dir() else []
    return chosen_segment(segments, wanted, folder, "download some: images/SEGMENT/CAMERA/FRAME.png")


def _photos(folder: Path) -> dict[str, dict[str, Path]]:
    """Camera -> frame -> file, of what is there."""
    return {
        camera.name: {path.stem: path for path in inside(camera) if path.suffix.lower() == ".png"}
        for camera in inside(folder)
        if camera.is_dir()
    }


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
    used: list[Calibration], photos: dict[str, dict[str, Path]], root: Path, subject: Subject
) -> tuple[tuple[View, ...], Fact | None]:
    """Cameras for the images at hand, and a note on the size that KRT refers to."""
    sizes = []
    for camera in used:
        frame, path = next(iter(photos[camera.name].items()))
        sizes.append(image_size(path, f"camera {camera.name}, frame {frame}"))
    reference, note = krt_reference(used, Counter(sizes).most_common(1)[0][0], subject.krt_size, root / "KRT")
    centres = PIXEL_CENTRES if subject.pixel_centres is None else subject.pixel_centres
    views = []
    for calibration, size in zip(used, sizes, strict=True):
        K = scaled_intrinsics(calibration.K, reference, size, centres)
        lens = make_lens(K, calibration.coefficients, *size, root / "KRT", f"camera {calibration.name}")
        pinhole = K if lens is None else lens.pinhole
        views.append(View(Camera(calibration.name, np.array(pinhole), closest_rotation(calibration.w2c), *size), lens))
    return tuple(views), note
