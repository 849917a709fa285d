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

from pathlib import Path

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
from facefolds_core.captures.krt import krt_reference, read_krt
from facefolds_core.captures.picture import Picture
from facefolds_core.captures.tracked import read_tracking
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.reading import check_folder, is_folder, is_there, read_text
from facefolds_core.params import CaptureParams, Subject

FPS = 30.0
PNG = (".png",)
PIXEL_CENTRES = 0.0
"""OpenCV's calibration, from which Multiface's KRT comes, puts the centre of the first pixel at 0."""


def recognise(root: Path) -> Recognised | None:
    """A folder with KRT, or with so much beside it that KRT is what is missing."""
    rest = is_folder(root / "images") and (is_folder(root / "tracked_mesh") or is_there(root / "frame_list.txt"))
    if not rest and not is_there(root / "KRT"):
        return None
    segments = [path.name for path in inside(root / "images") if path.is_dir()]
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
    """
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
    rate = frame_rate(subject, fps, len(frames))
    seconds = tuple(names.index(name) / (subject.fps or fps) for name in frames)
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
