"""NeRSemble (Kirschstein et al. 2023): one participant, as version 2, as version 1, or of the NVS benchmark.

    calibration/camera_params.json              world_2_cam {serial: 4 x 4}, intrinsics 3 x 3 or {serial: 3 x 3}
    calibration/color_calibration.json          {serial: 3 x 3}, on linear light (version 2)
    sequences/SEQUENCE/images/cam_SERIAL.mp4
    sequences/SEQUENCE/alpha_maps/cam_SERIAL.mp4    grey, where there are any (the NVS benchmark has them)
    sequences/BACKGROUND/image_SERIAL.jpg           clean plates (version 2)

Version 1, pictures by moment:

    camera_params.json                          in the participant's folder, or in calibration/
    sequences/SEQUENCE/timesteps/frame_00000/images-2x/cam_SERIAL.jpg    or without timesteps/, without -2x, with -73fps
    sequences/SEQUENCE/timesteps/frame_00000/alpha_map/cam_SERIAL.png
    annotations/SEQUENCE/color_correction/SERIAL.npy    affine, on values of the sRGB curve, RGB a row

World to camera, OpenCV's axes. Pictures stand upright: 2200 wide, 3208 high; intrinsics that are not per camera are
for that size, whatever the pictures' is. Lenses are taken to have no distortion. The rig films at 73 pictures a second;
frame numbers of version 1 count those. Read from

- tobias-kirschstein/nersemble-data: src/nersemble_data/ constants.py, data/nersemble_data.py, util/color_correction.py
- tobias-kirschstein/nersemble-benchmark: src/nersemble_benchmark/ constants.py, data/benchmark_data.py
- tobias-kirschstein/nersemble (version 1): src/nersemble/ data_manager/multi_view_data.py, nerfstudio/dataparser/
  nersemble_dataparser.py (K is scaled plainly, pixels count from their corners), nerfstudio/dataset/
  nersemble_dataset.py (the affine matrix).
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import (
    Calibration,
    Recognised,
    chosen_segment,
    footage,
    gather,
    inside,
    pictures_in,
)
from facefolds_core.captures.images import Colour
from facefolds_core.captures.numbers import matrix_from, read_npy, short
from facefolds_core.captures.picture import Picture
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.reading import check_folder, check_regular, is_folder, is_regular
from facefolds_core.files.writing import read_json
from facefolds_core.params import Subject

FULL_SIZE = (2200, 3208)
FPS = 73.0
PIXEL_CENTRES = 0.5
BACKGROUND = "BACKGROUND"
_REMEDY = "copy the file again from the dataset"
_MISSING = "point `path` at a participant's folder (018), which holds sequences/ and camera_params.json"

Photos = dict[str, dict[str, Picture]]


def recognise(root: Path) -> Recognised | None:
    """A participant's folder."""
    names = _sequences(root)
    if _calibration_file(root) is None or not names:
        return None
    keys = {"segment": names[0]} if len(names) > 1 else {}
    return Recognised(f"a NeRSemble participant, sequences {shorten(names)}", root, keys)


def read(root: Path, subject: Subject) -> Capture:
    """Of a participant's folder; `segment` of the subject is the sequence."""
    check_folder(root, _MISSING)
    sequence = chosen_segment(_sequences(root), subject.segment, root / "sequences", _MISSING, "sequence")
    folder = root / "sequences" / sequence
    if is_folder(folder / "images"):
        films, mattes = _videos(folder / "images"), _videos(folder / "alpha_maps")
        photos, fps = footage(films, subject) if films else ({}, FPS)
        alpha = footage(mattes, subject)[0] if mattes else {}
    else:
        photos, alpha, fps = _moments(folder)
    sizes = Counter(next(iter(of.values())).size(f"camera {name}") for name, of in photos.items() if of)
    common = sizes.most_common(1)[0][0] if sizes else FULL_SIZE
    calibrations = _calibrations(root, common)
    capture = gather(root, calibrations, photos, subject, masks=alpha, fps=fps, pixel_centres=PIXEL_CENTRES)
    colours, facts = _colours(root, sequence, [view.name for view in capture.views])
    plates = {
        name.removeprefix("image_"): plate for name, plate in pictures_in(root / "sequences" / BACKGROUND).items()
    }
    return replace(
        capture,
        views=tuple(replace(view, colour=colours.get(view.name)) for view in capture.views),
        plates={c: plates[view.name] for c, view in enumerate(capture.views) if view.name in plates},
        left_out=(*capture.left_out, *facts),
    )


def _calibration_file(root: Path) -> Path | None:
    places = (root / "calibration" / "camera_params.json", root / "camera_params.json")
    return next((path for path in places if is_regular(path)), None)


def _sequences(root: Path) -> list[str]:
    return [path.name for path in inside(root / "sequences") if path.is_dir() and path.name != BACKGROUND]


def _videos(folder: Path) -> dict[str, Path]:
    """Serial -> video."""
    found = [(re.fullmatch(r"cam_(\w+)", path.stem), path) for path in inside(folder) if path.suffix == ".mp4"]
    return {match[1]: path for match, path in found if match}


def _moments(folder: Path) -> tuple[Photos, Photos, float]:
    """Pictures and alpha maps of version 1, by serial and frame, and frames a second."""
    photos: Photos = defaultdict(dict)
    alpha: Photos = defaultdict(dict)
    timesteps = folder / "timesteps" if is_folder(folder / "timesteps") else folder
    numbers = []
    for moment in inside(timesteps):
        match = re.fullmatch(r"frame_(\d+)", moment.name)
        if match is None:
            continue
        numbers.append(int(match[1]))
        for part in reversed(inside(moment)):  # the plainest name last: it holds the largest pictures, and stays
            for into, kind in ((photos, "images"), (alpha, "alpha_map")):
                if part.name.startswith(kind):
                    for stem, picture in pictures_in(part).items():
                        into[stem.removeprefix("cam_")][match[1]] = picture
    steps = np.diff(sorted(numbers))
    return dict(photos), dict(alpha), FPS / float(np.median(steps)) if len(steps) else FPS


def _calibrations(root: Path, image: tuple[int, int]) -> list[Calibration]:
    """All cameras of the calibration.

    Args:
        image: (width, height) of most pictures.
    """
    path = _calibration_file(root) or root / "calibration" / "camera_params.json"
    check_regular(path, _MISSING)
    value = read_json(path, remedy=_REMEDY)
    poses, inner = (value.get(key) if isinstance(value, dict) else None for key in ("world_2_cam", "intrinsics"))
    if not isinstance(poses, dict) or not poses or not isinstance(inner, dict | list):
        found = shorten(sorted(value)) if isinstance(value, dict) else type(value).__name__
        expected = "an object with world_2_cam and intrinsics"
        raise UserError("no calibration", file=path, expected=expected, found=found, remedy=_REMEDY)
    if isinstance(inner, dict) and poses.keys() - inner.keys():
        raise UserError(
            "cameras without intrinsics",
            file=path,
            place="intrinsics",
            expected="a matrix for each camera of world_2_cam",
            found=f"none for {shorten(sorted(poses.keys() - inner.keys()))}",
            remedy=_REMEDY,
        )
    calibrations = []
    for serial, pose in poses.items():
        w2c = matrix_from(pose, ((4, 4), (3, 4)), path, f"world_2_cam, {serial}", _REMEDY)[:3]
        each = isinstance(inner, dict)
        K = matrix_from(inner[serial] if each else inner, ((3, 3),), path, f"intrinsics, {serial}", _REMEDY)
        size = _size_of(K, image)
        calibrations.append(Calibration(serial, K, w2c, path, f"camera {serial}", size=size))
    return calibrations


def _size_of(K: Any, image: tuple[int, int]) -> tuple[int, int]:
    """(width, height) that K is for: the pictures', or the rig's; in whose middle the principal point lies.

    Version 2 has one K, for the rig's size; the benchmark has one a camera, for its pictures of half that size.
    """
    return min((image, FULL_SIZE), key=lambda size: float(np.abs(K[:2, 2] / size - 0.5).max()))


def _colours(root: Path, sequence: str, serials: list[str]) -> tuple[dict[str, Colour], list[Fact]]:
    """Serial -> colour correction, and a note if there is any."""
    path = root / "calibration" / "color_calibration.json"
    if is_regular(path):
        value = read_json(path, remedy=_REMEDY)
        if not isinstance(value, dict):
            raise UserError(
                "no colour calibration", file=path, expected="an object", found=short(value), remedy=_REMEDY
            )
        colours = {serial: _linear(value[serial], path, serial) for serial in serials if serial in value}
    else:
        folders = (root / "annotations" / sequence, root / "sequences" / sequence / "annotations")
        files = [path for folder in folders for path in inside(folder / "color_correction") if path.suffix == ".npy"]
        path = next((file.parent for file in files if file.stem in serials), path)
        colours = {file.stem: _affine(file) for file in files if file.parent == path and file.stem in serials}
    return colours, [fact("colours_corrected", count=len(colours), file=path.name)] if colours else []


def _linear(rows: Any, path: Path, serial: str) -> Colour:
    """Of version 2. Its reader allows more terms (Cheung 2004); more than three colours are not read here."""
    return Colour(matrix_from(rows, ((3, 3),), path, f"camera {serial}", _REMEDY), np.zeros(3), linear=True)


def _affine(path: Path) -> Colour:
    """Of version 1: RGB @ A[:3, :3] + A[:3, 3]."""
    affine = read_npy(path, _REMEDY)
    if affine.shape not in ((3, 4), (4, 4)):
        expected = "a matrix of 3 x 4 or 4 x 4"
        raise UserError("no colour correction", file=path, expected=expected, found=f"{affine.shape}", remedy=_REMEDY)
    return Colour(affine[:3, :3].T, affine[:3, 3], linear=False)
