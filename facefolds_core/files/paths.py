"""Where each stage's files lie: `data/<subject>/...`, and which names and paths are let in there."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from facefolds_core.errors import UserError
from facefolds_core.files.parsing import brief

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]{0,63}")
NAMES = "letters (a to z), digits, _ and -, at most 64 of them, the first one no -"
"""What a subject's name may be: it becomes a folder, and a part of commands that people type."""


class _Within:
    """A path in the subject's folder."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, folders: SubjectFolders, _: object) -> Path:
        return folders.root / self.name


@dataclass(frozen=True)
class SubjectFolders:
    """Paths of one subject's files.

    Attributes:
        root: `data/<subject>`.
    """

    root: Path

    capture = _Within("capture")  # capture: the embedded actor in the Multiface layout; others: only `source.json`
    scene = _Within("scene")  # normalize: the normalised scene (captures/scene.py)
    subject = _Within("subject")  # subject: who stands where (subject/folder.py)
    model = _Within("model")  # train: `model.safetensors`, `model.json`, `training.json`, `params.json`
    # train and later stages: no output of any, so that a later run takes over what it would make again
    checkpoints = _Within("checkpoints")
    training_log = _Within("training")  # train: dvclive's folder
    samples = _Within("samples")  # sample: `grids.npz` and `textures.arrow`
    surfaces = _Within("surfaces")  # reconstruct: `surfaces.npz`
    meshes = _Within("meshes")  # decimate: `meshes.npz`
    resampled = _Within("resampled")  # texture: `textures.arrow`
    textures = _Within("textures")  # bake: `textures.arrow`, which ship
    asset = _Within("asset")  # compress: what ships
    glb = _Within("asset.glb")  # compress: one frame of the asset as binary glTF
    # evaluate: `per_image.parquet`, `contact_sheet.png`, `worst.png`, films, pictures of bad training views
    evaluation = _Within("evaluation")
    metrics = _Within("metrics.json")

    @property
    def config(self) -> Path:
        """configure: one JSON a stage. They lie beside the subject's folder, since one stage writes all subjects'."""
        return self.root.parent / ".config" / self.root.name

    def timing(self, stage: str) -> Path:
        """Seconds that a stage took, read by evaluate. Why they lie beside the subject's folder: .dvcignore."""
        return self.root.parent / ".timings" / self.root.name / f"{stage}.json"


def check_subject_name(name: object, file: str | Path | None = None) -> str:
    """The name, if it may be one.

    Raises:
        UserError: if it is no text, or holds anything that could lead to another folder, or that a shell reads.
    """
    if isinstance(name, str) and _NAME.fullmatch(name):
        return name
    quote = "" if isinstance(name, str) else " (with quotes, if it is to be this text)"
    raise UserError(
        "not a name for a subject",
        file=file,
        place="subjects" if file is not None else "--subject",
        expected=NAMES,
        found=brief(name),
        remedy=f"rename it{quote}",
    )


def subject_folders(data: Path, name: str) -> SubjectFolders:
    """The folders of one subject in `data`.

    Raises:
        UserError: if the name is none, so that no stage ever works outside `data`/NAME.
    """
    return SubjectFolders(data / check_subject_name(name))


def subject_of_dvc_stage(stage: str, dvc_stage: str) -> str:
    """The subject's name in what DVC says of the stage that it runs (`DVC_STAGE`): "train@anna" -> "anna".

    DVC hands it over in the environment, where no shell reads it; in a command of dvc.yaml it would be code.

    Raises:
        UserError: if it is of another stage (or none), or the name is none.
    """
    own, at, name = dvc_stage.rpartition("dvc.yaml:")[2].partition("@")
    if own != stage or not at:
        raise UserError(
            "which subject?",
            place="--subject",
            expected="a subject's name, or to be run by `dvc repro`",
            found=brief(dvc_stage) if dvc_stage else None,
            remedy="give --subject NAME",
        )
    return check_subject_name(name)


def check_path_text(path: str, name: str, file: str | Path, key: str = "path") -> None:
    """Args: a path that a subject gives, its name, the file that has them, and the subject's key.

    Raises:
        UserError: if it is no path of this machine: DVC would fetch an address, and programs take `-x` for an option.
    """
    wrong = None
    if not path.strip() or re.search(r"[\x00-\x1f\x7f]", path):
        wrong = "a folder's path, without control characters"
    elif re.match(r"[A-Za-z][A-Za-z0-9+.-]*://", path):
        wrong = "a folder on this machine: download it first"
    elif path.startswith(("-", "~")):
        wrong = "a path that begins with neither - nor ~: write it in full, or begin it with ./"
    if wrong:
        raise UserError(
            "not a path",
            file=file,
            place=f"subjects.{name}.{key}",
            expected=wrong,
            found=brief(path),
            remedy=f"write the folder that holds the {'capture' if key == 'path' else key}",
        )


OWN = {"path": "a capture", "mattes": "mattes of your own", "start": "Gaussians of your own"}
"""Key of a subject that names a path -> what lies there."""


def check_place(path: str, folders: SubjectFolders, key: str) -> Path:
    """The place that a key of a subject names, if the stages may read it.

    Raises:
        UserError: if it is no path of this machine, or leads (through links, too) into the subject's own folder or to
            one that holds it: there the stages would replace what they are to read.
    """
    check_path_text(path, folders.root.name, "params.yaml", key)
    what = OWN[key]
    place = f"subjects.{folders.root.name}.{key} in params.yaml"
    try:
        there = Path(path).resolve()
        own = (folders.root.resolve(), folders.capture.resolve())
    except (OSError, RuntimeError, ValueError) as error:
        raise UserError(
            "a path that cannot be followed", file=path, place=place, found=brief(str(error)), remedy="correct it"
        ) from None
    if there in own[0].parents or any(there.is_relative_to(folder) for folder in own):
        raise UserError(
            f"{what} where the stages write",
            file=path,
            place=place,
            expected=f"a place that neither lies in {folders.root} nor holds it",
            remedy=f"move {what} to a folder apart, and correct `{key}`; nothing was touched",
        )
    return Path(path)
