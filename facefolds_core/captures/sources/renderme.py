"""RenderMe-360 (Pan et al. 2023): one performance of one subject, in .smc files (HDF5).

    0026_e0_raw.smc     Camera/00/color/0: a JPEG's bytes
    0026_e0_anno.smc    Camera/00/mask/0, a mask's bytes; Calibration/00/K, D, RT

or everything in one file. `path` is such a file (the other half lies beside it, or in anno/ID next to raw/ID, as the
dataset is downloaded), or a folder of them, of which `segment` chooses the performance (`e0`, `s1_all`).

RT is camera to world, OpenCV axes: on the 60 calibrations of a real subject the optical axes meet within 16 mm and all
look inward; read as world to camera they fall apart. D is k1, k2, p1, p2, k3 of OpenCV; K counts pixels as OpenCV does;
a mask is the largest of its channels. Read from ZhuoyuanJiang/RenderMe360_extraction:
test_download/process_data/renderme_360_reader_Annotated.py (the dataset's own reader, annotated) and
extract_subject_FULL_both.py there (which file has what), and conallwang/RenderMe360_Tools: unfold_data.py (RT becomes
transform_matrix). The sound of s-performances is not read.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import Calibration, Recognised, chosen_segment, gather, inside
from facefolds_core.captures.numbers import numbers_from
from facefolds_core.captures.picture import Hdf5Picture, Picture, open_hdf5
from facefolds_core.errors import UserError
from facefolds_core.facts import shorten
from facefolds_core.files.reading import is_folder, is_regular
from facefolds_core.params import Subject

Array = NDArray[np.float64]

FPS = 30.0
PIXEL_CENTRES = 0.0
"""OpenCV's calibration puts the centre of the first pixel at 0."""
_REMEDY = "copy the file again from the dataset"
_NAME = re.compile(r"(?:\d+_)?(?P<performance>.+?)(?:_(?:raw|anno))?")


def recognise(root: Path) -> Recognised | None:
    """An .smc file, or a folder that holds some."""
    found = _performances(root)
    if not found:
        return None
    first = sorted(found)[0]
    what = "a RenderMe-360 performance" if len(found) == 1 else f"RenderMe-360, performances {shorten(sorted(found))}"
    return Recognised(what, root, {"segment": first} if len(found) > 1 else {})


def read(root: Path, subject: Subject) -> Capture:
    """Of an .smc file, or a folder of them, of whose performances `segment` of the subject chooses one."""
    files = _files(root, subject.segment)
    calibrated = []
    for file in files:
        with _sound(file):
            calibrated += [file] if isinstance(open_hdf5(file).get("Calibration"), h5py.Group) else []
    if not calibrated:
        raise UserError(
            "no calibration",
            file=files[0],
            place="Calibration",
            expected="Calibration/00/K, D and RT in one of the performance's .smc files",
            found=shorten([file.name for file in files]),
            remedy="put the performance's ..._anno.smc beside ..._raw.smc: it has the calibration",
        )
    with _sound(calibrated[0]):
        group = open_hdf5(calibrated[0])["Calibration"]
        size = _resolution(calibrated[0])
        calibrations = [_calibration(calibrated[0], name, group[name], size) for name in sorted(group)]
    return gather(
        root,
        calibrations,
        _pictures(files, "color"),
        subject,
        masks=_pictures(files, "mask"),
        fps=FPS,
        pixel_centres=PIXEL_CENTRES,
    )


@contextmanager
def _sound(file: Path) -> Iterator[None]:
    """What is raised while a damaged file is walked is the user's."""
    try:
        yield
    except (KeyError, OSError, RuntimeError, ValueError) as error:
        raise UserError("a damaged HDF5 file", file=file, found=str(error), remedy=_REMEDY) from None


def _performances(root: Path) -> dict[str, list[Path]]:
    """Performance -> its files, those with raw pictures first."""
    files = [root] if is_regular(root) else inside(root) if is_folder(root) else []
    found: dict[str, list[Path]] = defaultdict(list)
    for file in files:
        match = _NAME.fullmatch(file.stem)
        if file.suffix == ".smc" and match:
            found[match["performance"]].append(file)
    return {name: sorted(some, key=lambda file: "_anno" in file.name) for name, some in found.items()}


def _files(root: Path, wanted: str | None) -> list[Path]:
    """The files of the performance, and its annotations where the dataset's own folders have them."""
    found = _performances(root)
    missing = "point `path` at an .smc file of RenderMe-360, or at the folder that holds them"
    files = found[chosen_segment(found, wanted, root, missing, "performance")]
    if is_regular(root):
        other = root.name.replace("_raw.smc", "_anno.smc")
        near = [root.parent / other, root.parent.parent.parent / "anno" / root.parent.name / other]
        files = [root, *[file for file in near if file != root and is_regular(file)][:1]]
    return files


def _pictures(files: list[Path], kind: str) -> dict[str, dict[str, Picture]]:
    """Camera -> frame -> picture, of the first file that has any of the camera."""
    found: dict[str, dict[str, Picture]] = {}
    for file in files:
        with _sound(file):
            cameras = open_hdf5(file).get("Camera")
            for name in cameras if isinstance(cameras, h5py.Group) else ():
                frames = cameras[name].get(kind) if isinstance(cameras[name], h5py.Group) else None
                if isinstance(frames, h5py.Group) and len(frames) and not found.get(name):
                    found[name] = {frame: Hdf5Picture(file, f"Camera/{name}/{kind}/{frame}") for frame in frames}
    return found


def _resolution(file: Path) -> tuple[int, int] | None:
    """(width, height) that the cameras have, as the file says."""
    cameras = open_hdf5(file).get("Camera")
    value = cameras.attrs.get("resolution") if isinstance(cameras, h5py.Group) else None
    sides = np.ravel(np.asarray([] if value is None else value))
    if sides.size != 2 or sides.dtype.kind not in "iuf" or not (sides >= 1).all():
        return None
    return int(sides[1]), int(sides[0])


def _calibration(file: Path, name: str, group: Any, size: tuple[int, int] | None) -> Calibration:
    place = f"Calibration/{name}"
    K = _matrix(file, place, group, "K", [(3, 3)])
    RT = _matrix(file, place, group, "RT", [(4, 4), (3, 4)])[:3]
    D = _matrix(file, place, group, "D", [(n,) for n in (4, 5, 8)] + [s for n in (4, 5, 8) for s in ((1, n), (n, 1))])
    rotation = RT[:, :3].T
    w2c = np.concatenate([rotation, -(rotation @ RT[:, 3])[:, None]], 1)
    return Calibration(name, K, w2c, file, place, D.ravel(), size=size)


def _matrix(file: Path, place: str, group: Any, key: str, shapes: list[tuple[int, ...]]) -> Array:
    value = group.get(key) if isinstance(group, h5py.Group) else None
    found = np.asarray(value[()]) if isinstance(value, h5py.Dataset) else None
    if found is None or found.dtype.kind not in "iuf" or found.shape not in shapes:
        what = "nothing" if found is None else f"{found.dtype} {found.shape}"
        expected = f"numbers {' or '.join(map(str, shapes[:2]))}"
        raise UserError(
            "no such numbers", file=file, place=f"{place}/{key}", expected=expected, found=what, remedy=_REMEDY
        )
    return numbers_from(found.ravel().tolist(), file, f"{place}/{key}", _REMEDY).reshape(found.shape)
