"""Neural 3D Video (Li et al. 2022), and what was filmed in its layout.

    cam00.mp4  cam01.mp4 ...
    poses_bounds.npy            N x 17, row i for the i-th video in sorted order

A row is a 3 x 5 matrix and two depths: columns 0 to 2 are the camera's axes down, right, back in the world, column 3 is
its centre, column 4 height, width and focal length in pixels; the principal point is the picture's middle. Read from
facebookresearch/Neural_3D_Video: README.md (videos that are missing have no row; cam00 is held out by custom), which
refers to bmild/nerf, README.md ("Generating poses for your own scenes") and load_llff.py for the format.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import Calibration, Recognised, footage, gather, inside
from facefolds_core.captures.numbers import read_npy
from facefolds_core.errors import UserError
from facefolds_core.facts import shorten
from facefolds_core.files.reading import is_regular
from facefolds_core.geometry.cameras import HUGE, is_rotation
from facefolds_core.params import Subject

PIXEL_CENTRES = 0.5
"""The principal point is half the width: continuous coordinates."""
_REMEDY = "copy poses_bounds.npy and all videos of one scene again"


def recognise(root: Path) -> Recognised | None:
    """A folder with poses_bounds.npy and videos."""
    if not is_regular(root / "poses_bounds.npy") or not _videos(root):
        return None
    return Recognised("a scene of Neural 3D Video", root, {"holdout": [next(iter(_videos(root)))]})


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with poses_bounds.npy and the videos."""
    path = root / "poses_bounds.npy"
    rows = read_npy(path, "point `path` at the folder that holds poses_bounds.npy")
    files = _videos(root)
    if rows.ndim != 2 or rows.shape[1] != 17 or len(rows) != len(files):
        raise UserError(
            "poses and videos do not belong together",
            file=path,
            expected=f"{len(files)} rows of 17 numbers, one a video ({shorten(list(files))})",
            found=f"numbers of shape {rows.shape}",
            remedy=_REMEDY,
        )
    calibrations = [_camera(name, row, path, i) for i, (name, row) in enumerate(zip(files, rows, strict=True))]
    photos, fps = footage(files, subject)
    return gather(root, calibrations, photos, subject, fps=fps, pixel_centres=PIXEL_CENTRES)


def _videos(root: Path) -> dict[str, Path]:
    """Camera -> file, sorted by name, as the rows are."""
    paths = [path for path in inside(root) if re.fullmatch(r"cam\d+\.mp4", path.name, re.IGNORECASE)]
    return {path.stem: path for path in sorted(paths)}


def _camera(name: str, row: NDArray[np.float64], path: Path, index: int) -> Calibration:
    place = f"row {index} (camera {name})"
    wrong = partial(UserError, file=path, place=place, remedy=_REMEDY)
    down, right, back, centre, (height, width, focal) = row[:15].reshape(3, 5).T
    rotation = np.stack([right, down, -back])
    if not is_rotation(rotation):
        found = f"det = {np.linalg.det(rotation):.6g}, {np.round(rotation, 4).tolist()}"
        raise wrong("a row without a rotation", expected="columns down, right, back: orthonormal axes", found=found)
    if not (1 <= width <= 1 << 20 and 1 <= height <= 1 << 20 and abs(focal) <= HUGE):
        raise wrong(
            "a row without a picture's size",
            expected="height, width and focal length in pixels",
            found=[float(height), float(width), float(focal)],
        )
    K = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    w2c = np.concatenate([rotation, -(rotation @ centre)[:, None]], 1)
    return Calibration(name, K, w2c, path, place, size=(round(width), round(height)))
