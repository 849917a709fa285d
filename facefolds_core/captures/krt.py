"""Multiface's calibration file KRT.

For each camera eight lines: its name; the three rows of K; five distortion values (k1 k2 p1 p2 k3); the three rows of
[R | t], world -> camera with OpenCV axes, millimetres. Blank lines separate cameras. K refers to full-size images
(1334 x 2048) in the dataset, but copies with reduced images carry either that K or a scaled one: `krt_reference`.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from facefolds_core.captures.gathering import Calibration
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.files.reading import is_regular, read_text
from facefolds_core.geometry.cameras import HUGE, Camera, check_camera

FULL_SIZE = (1334, 2048)
"""(width, height) of Multiface's own images, v1 and v2."""
_REMEDY = "copy KRT again from the dataset, or mend this line"
_wrong = partial(UserError, remedy=_REMEDY)

_ROWS = (3, 3, 3, 5, 4, 4, 4)


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
        camera = _camera(block, path)
        if any(camera.name == other.name for other in cameras):
            raise _wrong("a camera appears twice in KRT", file=path, place=f"line {block[0][0]}", found=camera.name)
        cameras.append(camera)
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
    so the one with the smaller median distance |c / size - 1/2| holds, if that is under 1/4.

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
    if offsets[best] > 0.25:
        raise UserError(
            "cannot tell which image size KRT refers to",
            file=path,
            expected=f"principal points near the middle of {image[0]} x {image[1]} or {FULL_SIZE[0]} x {FULL_SIZE[1]}",
            found=words,
            remedy="set `krt_size: [width, height]` of this subject in params.yaml",
        )
    kind = "krt_is_scaled" if best == image else "krt_is_of_full_size"
    return best, [fact(kind, point=[float(x) for x in points], image=list(image))]
