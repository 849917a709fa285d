"""ActorsHQ (Isik et al. 2023): one scale of one sequence.

    4x/calibration.csv                              name, w, h, rx, ry, rz, tx, ty, tz, fx, fy, px, py
    4x/rgbs/Cam001/Cam001_rgb000000.jpg             background removed
    4x/masks/Cam001/Cam001_mask000000.png

Axis-angle and translation are camera to world, metres, axes right, down, forward; fx and px are in widths, fy and py in
heights of the picture. Read from synthesiaresearch/humanrf: README.md, actorshq/dataset/camera_data.py,
actorshq/dataset/volumetric_dataset.py; actorshq/toolbox/export_colmap.py hands px * w to COLMAP as it is, which counts
the first pixel's centre as 0.5. The rig films at 25 pictures a second (the paper, section 3); some of its cameras stand
upright, others lie: those of the rarer shape are left out.
"""

from __future__ import annotations

import csv
import io
import re
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import Calibration, Recognised, gather, inside, pictures_in
from facefolds_core.captures.picture import Picture
from facefolds_core.errors import UserError
from facefolds_core.files.reading import is_regular, read_text
from facefolds_core.geometry.cameras import HUGE
from facefolds_core.params import Subject

FPS = 25.0
PIXEL_CENTRES = 0.5
COLUMNS = ("name", "w", "h", "rx", "ry", "rz", "tx", "ty", "tz", "fx", "fy", "px", "py")
_REMEDY = "copy calibration.csv again from the dataset"
_wrong = partial(UserError, remedy=_REMEDY)


def recognise(root: Path) -> Recognised | None:
    """A scale's folder, or the sequence's with scales in it (the smallest pictures are suggested)."""
    scales = [root, *(root / name for name in ("4x", "2x", "1x"))]
    found = [folder for folder in scales if is_regular(folder / "calibration.csv")]
    if not found:
        return None
    what = "a scale of an ActorsHQ sequence" if found[0] == root else f"an ActorsHQ sequence (scales {len(found)})"
    return Recognised(what, found[0])


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with calibration.csv."""
    path = root / "calibration.csv"
    calibrations = _table(path)
    photos = {camera.name: _pictures(camera, "rgb") for camera in inside(root / "rgbs") if camera.is_dir()}
    masks = {camera.name: _pictures(camera, "mask") for camera in inside(root / "masks") if camera.is_dir()}
    return gather(root, calibrations, photos, subject, masks=masks, fps=FPS, pixel_centres=PIXEL_CENTRES)


def _pictures(camera: Path, kind: str) -> dict[str, Picture]:
    """Frame -> file, of Cam001_rgb000000.jpg."""
    pattern = re.compile(rf"{re.escape(camera.name)}_{kind}(\d+)")
    found = {pattern.fullmatch(stem): picture for stem, picture in pictures_in(camera).items()}
    return {match[1]: picture for match, picture in found.items() if match}


def _table(path: Path) -> list[Calibration]:
    text = read_text(path, "point `path` at the folder of one scale (4x), which holds it", expected="calibration.csv")
    rows = csv.DictReader(io.StringIO(text), skipinitialspace=True)
    header = rows.fieldnames or ()
    if not set(COLUMNS) <= set(header):
        raise _wrong(
            "a table of cameras without all columns",
            file=path,
            place="line 1",
            expected=", ".join(COLUMNS),
            found=", ".join(header)[:200] or "an empty file",
        )
    cameras: list[Calibration] = []
    for row in rows:
        if None in row or None in row.values():
            message, place = "a line of the table has too few or too many values", f"line {rows.line_num}"
            count = sum(value is not None for value in row.values()) + len(row.get(None, ())) - (None in row)
            raise _wrong(message, file=path, place=place, expected=f"{len(header)} values", found=f"{count}")
        cameras.append(_camera(row, path, rows.line_num))
    if not cameras:
        raise _wrong("a table without cameras", file=path, expected="a line a camera")
    return cameras


def _camera(values: dict[str, str], path: Path, line: int) -> Calibration:
    def number(name: str) -> float:
        try:
            value = float(values[name])
        except ValueError:
            value = float("nan")
        if not abs(value) <= HUGE:
            raise _wrong(
                "not a number",
                file=path,
                place=f"line {line} (camera {values['name']}), {name}",
                expected=f"a finite number, at most {HUGE:g}",
                found=values[name][:80],
            )
        return value

    width, height = number("w"), number("h")
    K = np.array([[number("fx") * width, 0, number("px") * width], [0, number("fy") * height, number("py") * height]])
    rotation = np.asarray(cv2.Rodrigues(np.array([number(n) for n in ("rx", "ry", "rz")]))[0], float).T
    centre = np.array([number(n) for n in ("tx", "ty", "tz")])
    w2c = np.concatenate([rotation, -(rotation @ centre)[:, None]], 1)
    K = np.concatenate([K, [[0, 0, 1]]])
    size = (max(1, round(width)), max(1, round(height)))
    return Calibration(values["name"], K, w2c, path, f"line {line} (camera {values['name']})", size=size)
