"""What the readers of folders have in common: from calibrated cameras and their pictures to a `Capture`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.captures.capture import Capture, View, closest_rotation, frame_rate, select_frames
from facefolds_core.captures.lens import make_lens
from facefolds_core.captures.picture import FilePicture, Picture, VideoFrame
from facefolds_core.captures.videos import CameraVideo, check_together
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.reading import is_folder
from facefolds_core.geometry.cameras import Array, Camera, check_camera
from facefolds_core.params import FrameRange, Subject

Photos = Mapping[str, Mapping[str, Picture]]
"""Camera -> frame -> picture."""

SUFFIXES = (".png", ".jpg", ".jpeg")


@dataclass(frozen=True)
class Recognised:
    """What a source module says of a folder that it would read.

    Attributes:
        what: in words, "a Multiface subject with 2 segments".
        path: what `path` of the subject should be: the folder asked about, or the one of its parts that is meant.
        keys: other keys that the subject needs, such as `segment`.
    """

    what: str
    path: Path
    keys: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Calibration:
    """One camera, as its layout has it.

    Attributes:
        name: as its pictures are called.
        K: (3, 3) in pixels of `size`, in the layout's own pixel coordinates.
        w2c: (3, 4) world -> camera, OpenCV axes.
        coefficients, fisheye: of the lens (`lens.Lens`); those at the end that are 0 may be left out.
        size: (width, height) that K refers to; None: that of the pictures, whatever it is.
        file, place: where it stands, for messages.
    """

    name: str
    K: Array
    w2c: Array
    file: Path
    place: str
    coefficients: Array = field(default_factory=lambda: np.zeros(0))
    fisheye: bool = False
    size: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        left_out = (4 if self.fisheye else 5) - len(self.coefficients)
        object.__setattr__(self, "coefficients", np.pad(self.coefficients, (0, max(0, left_out))))


def inside(folder: Path) -> list[Path]:
    """What lies in a folder, in natural order, but for hidden files; nothing where there is no folder."""
    return sorted((p for p in folder.iterdir() if not p.name.startswith(".")), key=natural) if is_folder(folder) else []


def natural(path: Path | str) -> tuple[tuple[int, int | str], ...]:
    """Key for sorting: numbers in names count as numbers, so that 9 comes before 10."""
    name = path.name if isinstance(path, Path) else path
    return tuple((0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", name) if part)


def pictures_in(folder: Path, suffixes: Collection[str] = SUFFIXES) -> dict[str, Picture]:
    """Stem -> PNG or JPEG file."""
    return {path.stem: FilePicture(path) for path in inside(folder) if path.suffix.lower() in suffixes}


def footage(files: Mapping[str, Path], subject: Subject) -> tuple[dict[str, dict[str, Picture]], float]:
    """Frames of videos that run side by side.

    Args:
        files: camera -> video.
        subject: its `frames` tell how many are used.

    Returns:
        camera -> frame -> picture, and frames a second.
    """
    videos = [CameraVideo(path, name) for name, path in files.items()]
    stop = subject.frames.stop if isinstance(subject.frames, FrameRange) else None
    count, rate = check_together(videos, stop)
    return {v.camera: {f"{i:06d}": VideoFrame(v, i) for i in range(count)} for v in videos}, float(rate)


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
    """
    used, facts = cameras_with_pictures(calibrations, photos, root)
    sizes, common = first_sizes(used, photos)
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
    names = [one.name for one in used]
    images = placed(photos, names, frames)
    opacity = {key: mask for key, mask in placed(masks or {}, names, frames).items() if key in images}
    return Capture(
        root,
        tuple(view_of(one, common, centres) for one in used),
        tuple(frames),
        frame_rate(subject, fps, len(frames)),
        images,
        opacity,
        None,
        (*left_out, *facts),
        mattes=opacity,
    )


def first_sizes(used: Sequence[Calibration], photos: Photos) -> tuple[dict[str, tuple[int, int]], tuple[int, int]]:
    """Camera -> (width, height) of its first picture, and the size that most have."""
    sizes = {}
    for name in [one.name for one in used]:
        frame, picture = next(iter(photos[name].items()))
        sizes[name] = picture.size(f"camera {name}, frame {frame}")
    return sizes, Counter(sizes.values()).most_common(1)[0][0]


def placed(photos: Photos, cameras: Sequence[str], frames: Sequence[str]) -> dict[tuple[int, int], Picture]:
    """(camera index, frame index) -> picture, of those that there are."""
    indices = [(c, f) for c, camera in enumerate(cameras) for f in range(len(frames)) if camera in photos]
    return {(c, f): photos[cameras[c]][frames[f]] for c, f in indices if frames[f] in photos[cameras[c]]}


def view_of(calibration: Calibration, size: tuple[int, int], pixel_centres: float) -> View:
    """The camera for pictures of `size` (width, height), its lens taken out."""
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
    return undistorted(calibration, K, closest_rotation(calibration.w2c), size)


def undistorted(calibration: Calibration, K: Array, w2c: Array, size: tuple[int, int]) -> View:
    """The camera of K (3, 3), continuous coordinates of pictures of `size`, and w2c (3, 4), its lens taken out."""
    one = calibration
    lens = make_lens(K, one.coefficients, *size, one.file, one.place, one.fisheye)
    return View(Camera(one.name, K if lens is None else lens.pinhole, w2c, *size), lens)


def scaled_intrinsics(K: Array, reference: tuple[int, int], image: tuple[int, int], pixel_centres: float) -> Array:
    """K of a layout -> K for the images at hand in continuous coordinates (docs/reference/conventions.md).

    Args:
        K: (3, 3) for images of size `reference`, whose first pixel has its centre at `pixel_centres`.
        reference, image: (width, height).
    """
    shift = np.array([[1, 0, 0.5 - pixel_centres], [0, 1, 0.5 - pixel_centres], [0, 0, 1]])
    scale = np.diag([image[0] / reference[0], image[1] / reference[1], 1.0])
    return np.asarray(scale @ shift @ K)


def cameras_with_pictures(
    calibrations: Sequence[Calibration],
    photos: Mapping[str, Mapping[str, Any]],
    root: Path,
    krt: bool = False,
) -> tuple[list[Calibration], list[Fact]]:
    """Cameras with both calibration and pictures, and facts on those without pictures, and without a calibration.

    Two calibrations of one name are refused.

    Args:
        photos: camera -> frame -> picture.
        krt: whether the calibrations are those of a KRT, which the facts then name.
    """
    known = [one.name for one in calibrations]
    twice = next((one for i, one in enumerate(calibrations) if one.name in known[:i]), None)
    if twice is not None:
        raise UserError(
            "a camera appears twice",
            file=twice.file,
            place=twice.place,
            found=twice.name,
            remedy="mend the calibration, or copy it again",
        )
    used = [one for one in calibrations if photos.get(one.name)]
    if not used:
        raise UserError(
            "no camera has both pictures and a calibration",
            file=root,
            expected=f"pictures of cameras named {shorten(known, 5)}",
            found=shorten(list(photos), 5) or "none",
            remedy="copy calibration and pictures of the same subject",
        )
    bare = [
        fact("camera_without_images" if krt else "no_images", camera=one.name)
        for one in calibrations
        if not photos.get(one.name)
    ]
    strange = [
        fact("camera_without_calibration" if krt else "uncalibrated", camera=name)
        for name in photos
        if name not in known and photos[name]
    ]
    return used, bare + strange


def chosen_segment(names: Collection[str], wanted: str | None, place: Path, missing: str, kind: str = "segment") -> str:
    """The segment that the subject names; the only one, where it names none.

    Args:
        names: of those that there are.
        place: where they were looked for.
        missing: remedy where there are none.
        kind: what the layout calls one; in params.yaml it is `segment` all the same.
    """
    if wanted in names:
        return str(wanted)
    if wanted is None and len(names) == 1:
        return next(iter(names))
    if not names:
        problem, remedy = f"no {kind}s", missing
    elif wanted is None:
        problem, remedy = f"several {kind}s, and none is chosen", "set `segment` of this subject in params.yaml"
    else:
        problem, remedy = f"no such {kind}", "correct `segment` of this subject in params.yaml"
    raise UserError(
        problem,
        file=place,
        place="segment",
        expected=f"one of {shorten(sorted(names), 100)}" if names else None,
        found=wanted,
        remedy=remedy,
    )
