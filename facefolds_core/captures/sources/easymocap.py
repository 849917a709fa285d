"""EasyMocap's layout, which ZJU-MoCap and EasyVolcap share.

    intri.yml           names, K_CAM, D_CAM or dist_CAM, H_CAM and W_CAM
    extri.yml           R_CAM (Rodrigues) or Rot_CAM, T_CAM
    images/CAM/000000.jpg   or CAM/000000.jpg, as in ZJU-MoCap, or videos/CAM.mp4
    mask*/CAM/000000.png    opacity, where there is any

World to camera, OpenCV's axes, its five coefficients of distortion and its pixel coordinates (the first pixel's centre
at 0); any unit. Read from zju3dv/EasyMocap: easymocap/mytools/camera_utils.py (keys) and doc/dataset.md (folders), and
zju3dv/EasyVolcap: easyvolcap/utils/easy_utils.py (Rot_ where R_ is missing, ccm_). Masks of ZJU-MoCap (mask_cihp) are
labels of parts, 0 to 19: what is not 0 is the subject, as zju3dv's readers take it. annots.npy of ZJU-MoCap is a
pickle, which can run code, and is not read.

The YAML is what OpenCV's `FileStorage` writes, 1.0 with matrices of its own tag, read as plain YAML: OpenCV's reader
prints to the terminal, and says of a damaged file neither line nor key.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import Calibration, Recognised, footage, gather, inside, pictures_in
from facefolds_core.captures.numbers import is_number, numbers_from, short
from facefolds_core.captures.picture import FilePicture, Picture
from facefolds_core.captures.videos import CONTAINERS
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.parsing import parse_yaml
from facefolds_core.files.reading import is_regular, read_text
from facefolds_core.params import Subject

FPS = 30.0
PIXEL_CENTRES = 0.0
_LABELS = 32
"""A mask of no larger value than this has labels of parts of the body, not opacity."""
REMEDY = "write the calibration again with the tool that made it"
_MISSING = "point `path` at the folder that holds intri.yml and extri.yml"


def recognise(root: Path) -> Recognised | None:
    """A folder with intri.yml and extri.yml."""
    if not all(is_regular(root / name) for name in ("intri.yml", "extri.yml")):
        return None
    return Recognised("a capture of EasyMocap (ZJU-MoCap, EasyVolcap)", root)


@dataclass(frozen=True)
class MaskFile(FilePicture):
    """A mask of opacity, or of labels."""

    def opacity(self, place: str) -> NDArray[np.uint8]:
        values = super().opacity(place)
        return np.where(values > 0, 255, 0).astype(np.uint8) if values.max() <= _LABELS else values


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with intri.yml and extri.yml."""
    intri = read_storage(root / "intri.yml", _MISSING)
    extri = read_storage(root / "extri.yml", _MISSING)
    names = _names(intri, root / "intri.yml")
    calibrations = [_calibration(root, intri, extri, name) for name in names]
    folders = root / "images" if (root / "images").is_dir() else root
    photos = {name: pictures_in(folders / name) for name in names}
    if folders != root:
        photos |= {folder.name: pictures_in(folder) for folder in inside(folders) if folder.is_dir()}
    fps = FPS
    if not any(photos.values()):
        photos, fps = _videos(root, subject)
    masks, facts = _masks(root, names)
    return gather(
        root, calibrations, photos, subject, masks=masks, fps=fps, pixel_centres=PIXEL_CENTRES, left_out=facts
    )


def _names(intri: dict[str, Any], path: Path) -> list[str]:
    """`names`; where they are missing, those of K_NAME."""
    names = intri.get("names", [key[2:] for key in intri if key.startswith("K_")])
    if not isinstance(names, list) or not names or not all(isinstance(name, str | int) for name in names):
        raise UserError(
            "no names of cameras", file=path, place="names", expected="a list", found=short(names), remedy=REMEDY
        )
    return [str(name) for name in names if name != "none"]  # EasyMocap ends its lists with "none"


def _calibration(root: Path, intri: dict[str, Any], extri: dict[str, Any], name: str) -> Calibration:
    inner, outer = root / "intri.yml", root / "extri.yml"
    vector = ((3, 1), (1, 3))
    K = needed_matrix(intri, {f"K_{name}": ((3, 3),)}, inner)
    lengths = tuple(shape for n in (5, 4, 8) for shape in ((n, 1), (1, n)))
    bent = [matrix_of(intri, f"{kind}_{name}", lengths, inner) for kind in ("D", "dist")]
    coefficients = next((one.ravel() for one in bent if one is not None), np.zeros(0))
    rotation = needed_matrix(extri, {f"R_{name}": vector, f"Rot_{name}": ((3, 3),)}, outer)
    if rotation.size == 3:
        rotation = np.asarray(cv2.Rodrigues(rotation.ravel())[0], float)
    translation = needed_matrix(extri, {f"T_{name}": vector}, outer)
    w2c = np.concatenate([rotation, translation.reshape(3, 1)], 1)
    sides: list[Any] = [intri.get(f"{side}_{name}") for side in "WH"]
    size = (round(sides[0]), round(sides[1])) if all(is_number(side) and 1 <= side < 1e6 for side in sides) else None
    return Calibration(name, K, w2c, inner, f"camera {name}", coefficients, size=size)


def _videos(root: Path, subject: Subject) -> tuple[dict[str, dict[str, Picture]], float]:
    """Camera -> frame -> picture, and frames a second."""
    files = {path.stem: path for path in inside(root / "videos") if path.suffix.lower() in CONTAINERS}
    if not files:
        pickle = is_regular(root / "annots.npy")
        raise UserError(
            "neither pictures nor videos",
            file=root,
            expected="images/CAM/000000.jpg or videos/CAM.mp4",
            found=shorten([path.name for path in inside(root)]) or "nothing",
            remedy="copy the pictures" + (" (annots.npy is a pickle: it is not read)" if pickle else ""),
        )
    return footage(files, subject)


def _masks(root: Path, names: list[str]) -> tuple[dict[str, dict[str, Picture]], list[Fact]]:
    """Of the first folder mask* that has any, and a note where there are several."""
    found: dict[str, dict[str, dict[str, Picture]]] = {}
    for folder in inside(root):
        if folder.is_dir() and folder.name.startswith("mask"):
            masks: dict[str, dict[str, Picture]] = {
                name: {stem: MaskFile(picture.file) for stem, picture in pictures_in(folder / name).items()}
                for name in names
            }
            if any(masks.values()):
                found[folder.name] = masks
    if not found:
        return {}, []
    first, *others = found
    return found[first], [fact("masks_chosen", chosen=first, others=others)] if others else []


def read_storage(path: Path, missing: str) -> dict[str, Any]:
    """Key -> value of such a file; matrices are mappings {rows, cols, dt, data} still (`matrix_of`).

    Args:
        missing: the remedy where there is no such file.
    """
    text = read_text(path, missing, expected=path.name)
    # "%YAML:1.0" is no directive of any YAML, and the tag tells no more than the mapping itself.
    text = re.sub(r"\A\s*%YAML[^\n]*\n", "\n", text).replace("!!opencv-matrix", "")
    value = parse_yaml(text, path, REMEDY)
    if not isinstance(value, dict):
        raise UserError("not OpenCV's YAML", file=path, expected="keys and matrices", found=short(value), remedy=REMEDY)
    return value


def matrix_of(
    storage: dict[str, Any], key: str, shapes: tuple[tuple[int, int], ...], path: Path
) -> NDArray[np.float64] | None:
    """(rows, cols) of finite numbers, or None where the key is not there."""
    value = storage.get(key)
    if value is None:
        return None

    def refuse(expected: str, found: object) -> UserError:
        return UserError("not a matrix", file=path, place=key, expected=expected, found=found, remedy=REMEDY)

    if not isinstance(value, dict) or not isinstance(value.get("data"), list):
        raise refuse("rows, cols, dt, data", short(value))
    shape, data = (value.get("rows"), value.get("cols")), value["data"]
    if shape not in shapes or len(data) != shape[0] * shape[1]:
        found = f"{shape[0]} x {shape[1]} of {len(data)} numbers"
        raise refuse(" or ".join(f"{rows} x {cols}" for rows, cols in shapes[:3]), found)
    return numbers_from(data, path, key, REMEDY).reshape(shape)


def needed_matrix(
    storage: dict[str, Any], keys: dict[str, tuple[tuple[int, int], ...]], path: Path
) -> NDArray[np.float64]:
    """`matrix_of` the first key that is there; the shapes that each may have are given with it."""
    found = [matrix_of(storage, key, shapes, path) for key, shapes in keys.items() if storage.get(key) is not None]
    if not found or found[0] is None:
        key = next(iter(keys))
        raise UserError("a key is missing", file=path, place=key, expected="a matrix", found="nothing", remedy=REMEDY)
    return found[0]
