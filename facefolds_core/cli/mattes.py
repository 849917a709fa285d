"""Cut the subject out of a scene's pictures: `facefolds mattes data/<subject>`; to look at, correct, and train with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from PIL import Image

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.config import read_train
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import atomic_folder
from facefolds_core.params import ExplicitParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.progress import progress
from facefolds_core.training.mattes.find import CutOut, find_mattes, wanted_pictures
from facefolds_core.training.mattes.sheet import contact_sheet
from facefolds_core.training.volume.fit import iterations, volume_frames
from facefolds_core.training.volume.search import find_subject


def command(
    subjects: Annotated[list[Path], typer.Argument(help="Folders of subjects whose scenes were made, as data/me.")],
    out: Annotated[
        Path | None, typer.Option(help="Where the mattes go; mattes in the subject's folder by default.")
    ] = None,
) -> None:
    """Mattes from the pictures alone: CAMERA/FRAME.png, and mattes.png to look at. Name the folder in `mattes` of the
    subject, with what you have corrected, to train with them."""
    with report_user_errors("mattes"):
        if out is not None and len(subjects) > 1:
            raise UserError("one folder for several subjects", place="--out", remedy="name one subject, or leave --out")
        for folders in map(SubjectFolders, subjects):
            _make(folders, folders.root / "mattes" if out is None else out)


def _make(folders: SubjectFolders, place: Path) -> None:
    if place.exists():
        raise UserError(
            "the mattes are there already",
            file=place,
            expected="no such folder: somebody may have corrected them by hand",
            remedy="remove it, or write others with --out FOLDER",
        )
    scene, params = read_scene(folders.scene), read_train(folders.config)
    params = params if isinstance(params, ExplicitParams) else ExplicitParams(seed=params.seed)
    bar = progress(total=iterations(params.volume), desc="mattes", unit="it")
    volume, notes = find_subject(scene, params, bar)
    pictures = wanted_pictures(scene, volume, volume_frames(scene, params))
    bar.total = bar.n + len(pictures)
    found = find_mattes(scene, volume, pictures, params, bar)
    bar.close()
    write_mattes(place, scene, found)
    names = [f"{scene.cameras[one.camera].name} {scene.frame_ids[one.frame]}" for one in found if not one.believed]
    for note in notes:
        typer.echo(f"mattes: {note}")
    more = f"; outvoted, and left out: {', '.join(names)}" if names else ""
    typer.echo(f"mattes: {len(found) - len(names)} pictures in {place}; look at {place / 'mattes.png'}{more}")


def write_mattes(place: Path, scene: Scene, found: list[CutOut]) -> None:
    """The folder, whole or not at all: a PNG a picture that is believed, and the sheet of all."""
    with atomic_folder(place) as temporary:
        Image.fromarray(contact_sheet(scene, found)).save(temporary / "mattes.png")
        for one in found:
            if one.believed:
                folder = temporary / scene.cameras[one.camera].name
                folder.mkdir(exist_ok=True)
                opacity = one.opacity(scene.height, scene.width)
                Image.fromarray(opacity).save(folder / f"{scene.frame_ids[one.frame]}.png")
