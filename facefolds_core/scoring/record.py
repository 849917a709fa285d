"""`evaluation/analysis.json` and the pictures beside it: what was seen, kept so that nobody has to render it again."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from facefolds_core.asset import Asset
from facefolds_core.asset.manifest_file import MANIFEST_NAME
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.files.writing import read_json, write_json
from facefolds_core.scoring.films import FilmFile
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.panels import HEADLINES, Panel
from facefolds_core.scoring.patches import WorstPatch
from facefolds_core.scoring.training_scores import TrainingView

VERSION = 2
NAME = "analysis.json"
PICTURES = "pictures"
DECIMALS = 6
REMEDY = "make it with `dvc repro` (on a fresh machine: `make repro`)"


@dataclass(frozen=True)
class View:
    """One held-out picture: images (H, W, 3) in [0, 1], mask (H, W) or None; dB as in docs/reference/metrics.md."""

    camera: str
    frame: str
    truth: Array
    asset: Array
    mask: Array | None
    psnr: float | None
    psnr_subject: float | None
    psnr_found: float | None = None
    psnr_over_plate: float | None = None
    psnr_any: float | None = None
    over: Array | None = None
    """The asset over the camera's clean plate."""


@dataclass(frozen=True)
class Crop:
    """The worst window of all held-out pictures and what lies around it: truth, asset (h, w, 3) in [0, 1] over grey.

    Attributes:
        psnr: dB, of the window.
        box: (row, column, side) of the window in the crops.
    """

    camera: str
    frame: str
    psnr: float
    box: tuple[int, int, int]
    truth: Array
    asset: Array


@dataclass(frozen=True)
class Record:
    """What `evaluate` saw.

    Attributes:
        views: those of the contact sheet in its order, then the worst where it is not among them.
        on_sheet: how many of them are of the contact sheet.
        worst: index of the view with the lowest PSNR of all held-out pictures.
        films: of the held-out cameras, in `folder`.
        folder: of the evaluation.
        patch: where the asset is worst; None where that is not known.
    """

    views: tuple[View, ...]
    on_sheet: int
    worst: int
    films: tuple[FilmFile, ...] = ()
    folder: Path = Path()
    patch: Crop | None = None


def write_record(
    folder: Path,
    panels: Sequence[Panel],
    worst: Panel,
    asset: Asset,
    films: Sequence[FilmFile] = (),
    patch: WorstPatch | None = None,
    training: Sequence[TrainingView] = (),
) -> None:
    """Write into `folder`, which `evaluate` makes.

    Args:
        training: views whose pictures are kept, photo beside asset.
    """
    listed = panels if any(panel is worst for panel in panels) else [*panels, worst]
    (folder / PICTURES).mkdir()
    value = {
        "version": VERSION,
        "asset": digest_of(asset),
        "views": [_write_view(folder, i, panel) for i, panel in enumerate(listed)],
        "on_sheet": len(panels),
        "worst": next(i for i, panel in enumerate(listed) if panel is worst),
        "films": [asdict(film) for film in films],
        "patch": None if patch is None else _write_patch(folder, patch),
    }
    for view in training:
        _save(folder / PICTURES / f"training_{view.camera}.png", np.concatenate([view.truth, view.asset], 1))
    write_json(folder / NAME, _rounded(value))


def _write_view(folder: Path, index: int, panel: Panel) -> dict[str, Any]:
    images = {"truth": panel.truth, "asset": panel.asset, "mask": panel.mask, "over": panel.over}
    entry: dict[str, Any] = {"camera": panel.camera, "frame": panel.frame}
    entry |= {name: panel.asset_score.values.get(name) for name in reversed(HEADLINES)}
    for name, image in images.items():
        entry[name] = None if image is None else f"{PICTURES}/{index:03d}_{name}.png"
        if image is not None:
            _save(folder / entry[name], image)
    return entry


def _write_patch(folder: Path, patch: WorstPatch) -> dict[str, Any]:
    files = {name: f"{PICTURES}/patch_{name}.png" for name in ("truth", "asset")}
    for name, file in files.items():
        _save(folder / file, getattr(patch, name))
    box = [patch.place.row - patch.corner[0], patch.place.column - patch.corner[1], patch.place.side]
    return {"camera": patch.camera, "frame": patch.frame, "psnr": patch.place.psnr, "box": box, **files}


def _save(path: Path, image: Array) -> None:
    """A picture whose values are multiples of 1/255: nothing is lost."""
    Image.fromarray(np.rint(255 * image).astype(np.uint8)).save(path)


def _rounded(value: Any) -> Any:
    """JSON with fewer digits, and null for NaN."""
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    if isinstance(value, float):
        return None if math.isnan(value) else round(value, DECIMALS)
    return value


def digest_of(asset: Asset) -> str:
    """Names the asset: SHA-256 of its manifest, which holds those of its files."""
    return hashlib.sha256((asset.folder / MANIFEST_NAME).read_bytes()).hexdigest()


def read_record(folder: Path, asset: Asset) -> Record | None:
    """What was seen of `asset`; None where nothing was kept.

    Raises:
        UserError: if it is of another asset, garbled, or a picture is missing or damaged.
    """
    path = folder / NAME
    if not path.is_file():
        return None
    value = read_json(path, remedy=REMEDY)
    try:
        if value["version"] != VERSION:
            raise UserError("of another version", file=path, expected=VERSION, found=value["version"], remedy=REMEDY)
        if value["asset"] != digest_of(asset):
            raise UserError("the evaluation is of another asset", file=path, expected=asset.folder, remedy=REMEDY)
        views = tuple(_read_view(folder, entry) for entry in value["views"])
        return Record(
            views=views,
            on_sheet=int(value["on_sheet"]),
            worst=range(len(views))[value["worst"]],
            films=tuple(_read_film(one) for one in value.get("films", ())),
            folder=folder,
            patch=_read_patch(folder, value.get("patch")),
        )
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise UserError("garbled record of an evaluation", file=path, found=repr(error), remedy=REMEDY) from None


def _read_film(entry: dict[str, Any]) -> FilmFile:
    file = str(entry["file"])
    if not re.fullmatch(r"films/[0-9]+\.mp4", file):
        raise ValueError(f"{file[:80]} is no film of an evaluation")
    return FilmFile(str(entry["camera"]), file, float(entry["fps"]), tuple(map(str, entry["frames"])))


def _read_patch(folder: Path, entry: dict[str, Any] | None) -> Crop | None:
    if entry is None:
        return None
    row, column, side = (int(number) for number in entry["box"])
    pictures = {name: _read_picture(folder / entry[name]) for name in ("truth", "asset")}
    return Crop(str(entry["camera"]), str(entry["frame"]), float(entry["psnr"]), (row, column, side), **pictures)


def _read_picture(path: Path) -> Array:
    try:
        return np.asarray(open_picture(path)) / 255.0
    except (OSError, DamagedPictureError) as error:
        message = "a picture of the evaluation is damaged"
        raise UserError(message, file=path, found=str(error), remedy=REMEDY) from None


def _read_view(folder: Path, entry: dict[str, Any]) -> View:
    images: dict[str, Any] = {}
    for name in ("truth", "asset", "mask", "over"):
        file: Any = entry.get(name)
        images[name] = None if file is None else _read_picture(folder / file)
    values: dict[str, Any] = {name: entry.get(name) for name in HEADLINES}
    return View(entry["camera"], entry["frame"], **images, **values)
