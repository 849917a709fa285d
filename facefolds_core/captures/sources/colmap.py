"""COLMAP: a sparse model and the pictures that it registered, of a still scene or of a rig that films.

    sparse/0/cameras.bin|.txt  images.bin|.txt      or in `path` itself
    images/CAM/000000.jpg                           a folder a camera: a film; all its pictures are used
    images/00001.jpg                                else each picture is a camera of a still scene

A rig is often registered by its first pictures only, `CAM.jpg` or `CAM/000000.jpg`: where there is a folder images/CAM,
all pictures in it have that camera's pose. Where every picture of a folder was registered, their poses differ a little;
the mean of a camera is used. World to camera, quaternion w, x, y, z, OpenCV's axes (`colmap_model`). pycolmap is not
needed: it is a large binary, and the formats are small.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePosixPath

from facefolds_core.captures.arrangement import Shot, arrange, mean_calibration
from facefolds_core.captures.capture import Capture
from facefolds_core.captures.colmap_model import model_folder, read_model
from facefolds_core.captures.gathering import Calibration, Recognised, gather, inside, pictures_in
from facefolds_core.captures.picture import FilePicture, Picture
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.files.reading import is_folder, is_there
from facefolds_core.params import CaptureParams, Subject

FPS = 30.0
PIXEL_CENTRES = 0.5
Photos = dict[str, dict[str, Picture]]


def recognise(root: Path) -> Recognised | None:
    """A folder with a sparse model, below it or in it."""
    folder = model_folder(root)
    if folder is None:
        return None
    return Recognised("a COLMAP model" if folder == root else f"a COLMAP model, in {folder.relative_to(root)}", root)


def read(root: Path, subject: Subject, params: CaptureParams) -> Capture:
    """Of the folder with sparse and images."""
    folder = model_folder(root)
    if folder is None:
        raise UserError(
            "no COLMAP model",
            file=root,
            expected="cameras and images (.bin or .txt) in sparse/0, sparse or the folder itself",
            remedy="point `path` at the folder that holds sparse and images",
        )
    images, file = read_model(folder)
    near = (root / "images", folder / "images", folder.parent.parent / "images")
    pictures = next((place for place in near if is_folder(place)), root)
    films = _films(images, pictures)
    if films is None:
        groups, photos, left_out = _registered(images, pictures, file)
    else:
        groups = {name: [image] for name, (image, _) in films.items()}
        photos, left_out = {name: pictures_in(place) for name, (_, place) in films.items()}, []
    each = [[replace(i, name=name, place=f"{i.place} ({i.name})") for i in of] for name, of in groups.items()]
    left_out += _other_models(folder)
    means = [mean_calibration(some) for some in each]
    return gather(root, means, photos, subject, fps=FPS, pixel_centres=PIXEL_CENTRES, left_out=left_out)


def _films(images: list[Calibration], pictures: Path) -> dict[str, tuple[Calibration, Path]] | None:
    """Camera -> its one registered picture and the folder of its film; None unless every picture has one of its own."""
    found = {}
    for image in images:
        path = PurePosixPath(image.name)
        folders = [pictures / path.with_suffix("")] + ([pictures / path.parent] if path.parent.name else [])
        film = next((folder for folder in folders if len(pictures_in(folder)) > 1), None)
        if film is None or film.name in found:
            return None
        found[film.name] = image, film
    return found


def _registered(
    images: list[Calibration], pictures: Path, file: Path
) -> tuple[dict[str, list[Calibration]], Photos, list[Fact]]:
    """Cameras with their registered pictures, the pictures by frame, and facts on those that are missing.

    Of a camera that has a folder of its own, pictures count that were not registered, too.
    """
    paths = {image.name: _find(pictures, image.name) for image in images}
    facts = [fact("image_missing", place=f"{file.name}, {i.place}", image=i.name) for i in images if not paths[i.name]]
    images = [image for image in images if paths[image.name]]
    if not images:
        raise UserError(
            "none of the registered pictures exists",
            file=pictures,
            expected=next(iter(paths)),
            found="no such file",
            remedy="put the pictures that COLMAP saw into the folder images",
        )
    paths_there = [PurePosixPath(image.name) for image in images]
    shots = [Shot(p.stem, p.parent.name, None, image.w2c) for p, image in zip(paths_there, images, strict=True)]
    arranged = arrange(shots, file)
    groups = {name: [images[i] for i in of] for name, of in arranged.cameras.items()}
    photos: Photos = {}
    for name, of in arranged.cameras.items():
        own = paths_there[of[0]].parent
        if len(of) > 1 and own.name == name:
            photos[name] = pictures_in(pictures / own)
        else:
            photos[name] = {arranged.frame_of[i]: FilePicture(pictures / images[i].name) for i in of}
    return groups, photos, facts


def _find(pictures: Path, name: str) -> bool:
    """Whether a registered picture is there; names that lead out of the folder are none."""
    path = PurePosixPath(name)
    return ".." not in path.parts and not path.is_absolute() and is_there(pictures / name)


def _other_models(folder: Path) -> list[Fact]:
    """A note where COLMAP found several models that do not hang together."""
    if folder.name != "0":
        return []
    others = [path.name for path in inside(folder.parent) if path.name != "0" and model_folder(path) == path]
    return [fact("other_models", others=others)] if others else []
