"""From calibrated cameras and their pictures to a `Capture`: what the readers of folders have in common."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Capture, View, closest_rotation, frame_rate, select_frames
from facefolds_core.captures.krt import scaled_intrinsics
from facefolds_core.captures.lens import make_lens
from facefolds_core.captures.matching import cameras_with_pictures
from facefolds_core.captures.picture import FilePicture, Picture, VideoFrame
from facefolds_core.captures.videos import Video, check_together, frame_names
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.cameras import Camera, check_camera
from facefolds_core.params import FrameRange, Subject
from facefolds_core.reading import is_folder

Array = NDArray[np.float64]
Photos = Mapping[str, Mapping[str, Picture]]
"""Camera -> frame -> picture."""

SUFFIXES = (".png", ".jpg", ".jpeg")


@dataclass(frozen=True, eq=False)
class Calibration:
    """One camera, as its layout has it.

    Attributes:
        name: as its pictures are called.
        K: (3, 3) in pixels of `size`, in the layout's own pixel coordinates.
        w2c: (3, 4) world -> camera, OpenCV axes.
        coefficients, fisheye: of the lens (`lens.Lens`).
        size: (width, height) that K refers to; None: that of the pictures, whatever it is.
        file, place: where it stands, for messages.
    """

    name: str
    K: Array
    w2c: Array
    file: Path
    place: str
    coefficients: Array
    fisheye: bool = False
    size: tuple[int, int] | None = None


def inside(folder: Path) -> list[Path]:
    """What lies in a folder, in natural order, but for hidden files; nothing where there is no folder."""
    return sorted((p for p in folder.iterdir() if not p.name.startswith(".")), key=natural) if is_folder(folder) else []


def natural(path: Path | str) -> tuple[tuple[int, int | str], ...]:
    """Key for sorting: numbers in names count as numbers, so that 9 comes before 10."""
    name = path.name if isinstance(path, Path) else path
    return tuple((0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", name) if part)


def pictures_in(folder: Path) -> dict[str, Picture]:
    """Stem -> PNG or JPEG file."""
    return {path.stem: FilePicture(path) for path in inside(folder) if path.suffix.lower() in SUFFIXES}


def footage(files: Mapping[str, Path], subject: Subject) -> tuple[dict[str, dict[str, Picture]], float]:
    """Frames of videos that run side by side.

    Args:
        files: camera -> video.
        subject: its `frames` tell how many are used.

    Returns:
        camera -> frame -> picture, and frames a second.

    Raises:
        UserError: as `check_together`.
    """
    videos = [Video(path, name) for name, path in files.items()]
    stop = subject.frames.stop if isinstance(subject.frames, FrameRange) else None
    count, rate = check_together(videos, stop)
    names = frame_names(count)
    return {v.camera: {name: VideoFrame(v, i) for i, name in enumerate(names)} for v in videos}, float(rate)


def gather(
    root: Path,
    calibrations: Sequence[Calibration],
    photos: Photos,
    subject: Subject,
    *,
    masks: Photos | None = None,
    fps: float,
    pixel_centres: float,
    left_out: Sequence[Fact] = (),
) -> Capture:
    """The capture of calibrated cameras.

    Args:
        photos: all pictures, also of cameras that nobody calibrated.
        subject: its `frames`, `fps` and `pixel_centres` are used.
        masks: opacity, where the layout has it: training may use it, held-out pictures are scored by it.
        fps: where the subject leaves it null.
        pixel_centres: of the layout, likewise.

    Raises:
        UserError: if no camera has both calibration and pictures, calibrations cannot be, or sizes do not fit.
    """
    used, bare, strange = cameras_with_pictures(calibrations, photos, root)
    facts = [fact("no_images", camera=name) for name in bare] + [fact("uncalibrated", camera=name) for name in strange]
    sizes = {}
    for one in used:
        frame, picture = next(iter(photos[one.name].items()))
        sizes[one.name] = picture.size(f"camera {one.name}, frame {frame}")
    common = Counter(sizes.values()).most_common(1)[0][0]
    facts += [
        fact("other_size", camera=name, size=list(size), common=list(common))
        for name, size in sizes.items()
        if size != common
    ]
    used = [one for one in used if sizes[one.name] == common]
    names = sorted({frame for one in used for frame in photos[one.name]}, key=natural)
    frames = select_frames(names, subject.frames, root, "the capture")
    centres = pixel_centres if subject.pixel_centres is None else subject.pixel_centres
    scaled = [one.name for one in used if one.size not in (None, common)]
    if scaled:
        facts.append(fact("k_is_scaled", cameras=scaled, size=list(common)))
    keys = [(c, f) for c, one in enumerate(used) for f, frame in enumerate(frames) if frame in photos[one.name]]
    opacity = {
        (c, f): masks[used[c].name][frames[f]] for c, f in keys if masks and frames[f] in masks.get(used[c].name, ())
    }
    return Capture(
        root,
        tuple(view_of(one, common, centres) for one in used),
        tuple(frames),
        frame_rate(subject, fps, len(frames)),
        {(c, f): photos[used[c].name][frames[f]] for c, f in keys},
        opacity,
        None,
        (*left_out, *facts),
        mattes=opacity,
    )


def view_of(calibration: Calibration, size: tuple[int, int], pixel_centres: float) -> View:
    """The camera for pictures of `size` (width, height), its lens taken out.

    Raises:
        UserError: if K refers to pictures of another shape, the camera cannot be, or the lens cannot be undone.
    """
    reference = calibration.size or size
    if abs(reference[0] * size[1] / (reference[1] * size[0]) - 1) > 0.01:  # rounded sides of small pictures
        raise UserError(
            "the pictures have another shape than the calibration says",
            file=calibration.file,
            place=calibration.place,
            expected=f"pictures of {reference[0]} x {reference[1]}, or all of them smaller by the same factor",
            found=f"{size[0]} x {size[1]}",
            remedy="use the pictures that were calibrated, neither cropped nor turned",
        )
    K = scaled_intrinsics(calibration.K, reference, size, pixel_centres)
    camera = Camera(calibration.name, K, calibration.w2c, *size)
    check_camera(camera, calibration.file, calibration.place)
    lens = make_lens(
        K, calibration.coefficients, *size, calibration.file, calibration.place, fisheye=calibration.fisheye
    )
    pinhole = K if lens is None else lens.pinhole
    return View(Camera(calibration.name, pinhole, closest_rotation(calibration.w2c), *size), lens)
