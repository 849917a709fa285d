"""`evaluation/analysis.json` and the pictures beside it: what was seen, kept so that nobody has to render it again."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from facefolds_core.asset import Asset
from facefolds_core.asset.manifest_file import MANIFEST_NAME
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.files.writing import file_sha256, read_json, write_json
from facefolds_core.scoring.films import FilmFile
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.panels import HEADLINES, Panel
from facefolds_core.scoring.patches import WorstPatch
from facefolds_core.scoring.training_scores import TrainingView

VERSION = 2
NAME = "analysis.json"
PICTURES = "pictures"
IMAGES = ("truth", "asset", "mask", "over")
FILM = re.compile(r"films/[0-9]+\.mp4")
REMEDY = "make it with `dvc repro` (on a fresh machine: `make repro`)"


@dataclass(frozen=True)
class View:
    """One held-out picture: images (H, W, 3) in [0, 1], mask (H, W) or None.

    Attributes:
        values: HEADLINES, dB, as in docs/reference/metrics.md; None where one cannot be had.
        over: the asset over the camera's clean plate.
    """

    camera: str
    frame: str
    values: Mapping[str, float | None]
    truth: Array
    asset: Array
    mask: Array | None = None
    over: Array | None = None


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
        worst: index of the view with the lowest PSNR of all held-out pictures.
        films: of the held-out cameras, in `folder`.
        folder: of the evaluation.
        patch: where the asset is worst; None where that is not known.
    """

    views: tuple[View, ...]
    worst: int
    films: tuple[FilmFile, ...]
    folder: Path
    patch: Crop | None


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
    views = [
        {"camera": panel.camera, "frame": panel.frame}
        | {name: panel.asset_score.values.get(name) for name in HEADLINES}
        | _saved(folder, f"{i:03d}", {name: getattr(panel, name) for name in IMAGES})
        for i, panel in enumerate(listed)
    ]
    value = {
        "version": VERSION,
        "asset": digest_of(asset),
        "views": views,
        "worst": next(i for i, panel in enumerate(listed) if panel is worst),
        "films": [asdict(film) for film in films],
        "patch": None if patch is None else _patch(folder, patch),
    }
    for view in training:
        _saved(folder, "training", {view.camera: np.concatenate([view.truth, view.asset], 1)})
    write_json(folder / NAME, value)


def _patch(folder: Path, patch: WorstPatch) -> dict[str, Any]:
    box = [patch.place.row - patch.corner[0], patch.place.column - patch.corner[1], patch.place.side]
    files = _saved(folder, "patch", {"truth": patch.truth, "asset": patch.asset})
    return {"camera": patch.camera, "frame": patch.frame, "psnr": patch.place.psnr, "box": box, **files}


def _saved(folder: Path, prefix: str, images: Mapping[str, Array | None]) -> dict[str, Any]:
    """Write pictures, whose values are multiples of 1/255: nothing is lost. Their files by name."""
    files = {name: image if image is None else f"{PICTURES}/{prefix}_{name}.png" for name, image in images.items()}
    for name, image in images.items():
        if image is not None:
            Image.fromarray(np.rint(255 * image).astype(np.uint8)).save(folder / str(files[name]))
    return files


def digest_of(asset: Asset) -> str:
    """Names the asset: SHA-256 of its manifest, which holds those of its files."""
    return file_sha256(asset.folder / MANIFEST_NAME)


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
        views = tuple(
            View(one["camera"], one["frame"], {name: one[name] for name in HEADLINES}, **_opened(folder, one, IMAGES))
            for one in value["views"]
        )
        films = tuple(FilmFile(**one) for one in value["films"])
        if not all(FILM.fullmatch(film.file) for film in films):
            raise ValueError("a file that is no film of an evaluation")
        return Record(views, range(len(views))[value["worst"]], films, folder, _read_patch(folder, value["patch"]))
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise UserError("garbled record of an evaluation", file=path, found=repr(error), remedy=REMEDY) from None


def _read_patch(folder: Path, entry: dict[str, Any] | None) -> Crop | None:
    if entry is None:
        return None
    row, column, side = (int(number) for number in entry["box"])
    pictures = _opened(folder, entry, ("truth", "asset"))
    return Crop(entry["camera"], entry["frame"], float(entry["psnr"]), (row, column, side), **pictures)


def _opened(folder: Path, entry: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Pictures by name; None of those that were not kept."""
    return {name: None if entry[name] is None else _read_picture(folder / entry[name]) for name in names}


def _read_picture(path: Path) -> Array:
    try:
        return np.asarray(open_picture(path)) / 255.0
    except (OSError, DamagedPictureError) as error:
        message = "a picture of the evaluation is damaged"
        raise UserError(message, file=path, found=str(error), remedy=REMEDY) from None
