"""A subject's folder of work: where the API's steps put their files, laid out as the stages have it."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from facefolds_core.captures.scene import Scene
from facefolds_core.config.params_file import Params, write_configs, write_section
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders, subject_folders
from facefolds_core.params import Subject, section_of
from facefolds_core.pipeline.running import run_alone

_TEMPORARY: list[TemporaryDirectory[str]] = []
"""Folders of this process: they go when Python ends, since a scene or an asset may be used until then."""

OPENED = ("subject", "model", "asset")
"""What is taken over of a subject's folder that is opened, beside the scene."""


def new_folders(name: str, folder: str | Path | None) -> SubjectFolders:
    """The folders of one subject.

    Args:
        name: of the subject.
        folder: holds one folder a subject, as `data` does; None takes a temporary one, which goes when Python ends.

    Raises:
        UserError: if the name is none.
    """
    if folder is None:
        _TEMPORARY.append(TemporaryDirectory(prefix="facefolds-", ignore_cleanup_errors=True))
        folder = _TEMPORARY[-1].name
    return subject_folders(Path(folder), name)


def write_defaults(folders: SubjectFolders, entry: Subject) -> None:
    """Write all stages' parameters, as `configure` does, with their defaults."""
    name = folders.root.name
    write_configs(Params(subjects={name: entry}, sections={}, path="the API"), name, folders.config)


def set_params(folders: SubjectFolders, stage: str, keys: Mapping[str, Any]) -> None:
    """Write a stage's parameters: its defaults but for `keys`.

    Raises:
        UserError: if a key or a value is wrong.
    """
    write_section(stage, section_of(stage, dict(keys)), folders.config)


def run(stage: str, folders: SubjectFolders, *outputs: Path) -> None:
    """Do what a stage does.

    Args:
        outputs: of what it writes, what may be a link to another subject's folder (`open_folders`): links go first.
    """
    for path in outputs:
        if path.is_symlink():
            path.unlink()
    run_alone(stage, getattr(importlib.import_module(f"facefolds_core.pipeline.{stage}"), stage), folders)


def folders_of(scene: Scene) -> SubjectFolders:
    """The folder of work that a scene of the API lies in.

    Raises:
        UserError: if it lies in none.
    """
    folders = SubjectFolders(scene.folder.parent)
    if scene.folder != folders.scene or not (folders.config / "entry.json").is_file():
        raise UserError(
            "the scene has no folder of work",
            file=scene.folder,
            expected="a scene that `normalize` or `load_scene` has given",
            remedy="load it with `facefolds_core.load_scene`",
        )
    return folders


def open_folders(scene: Scene, folder: str | Path | None) -> SubjectFolders:
    """A folder of work with what another subject's folder has, by links: nothing there is changed.

    Args:
        scene: of the other folder, as read from it.
        folder: see `new_folders`; where the other folder lies in it, that one itself is gone on with.

    Raises:
        UserError: if another subject of this name has been worked on in `folder`.
    """
    home, folders = SubjectFolders(scene.folder.resolve().parent), new_folders(scene.subject, folder)
    if folders.root.resolve() != home.root:
        if folders.root.exists():
            raise UserError(
                "a subject of this name is there already",
                file=folders.root,
                expected="a folder without it, to work in",
                remedy="name another folder, or load the scene that is there",
            )
        folders.root.mkdir(parents=True)
        folders.scene.symlink_to(scene.folder.resolve())
        for name in OPENED:
            if (home.root / name).exists():
                (folders.root / name).symlink_to(home.root / name)
        for there, here in ((home.config, folders.config), (home.timing("x").parent, folders.timing("x").parent)):
            if there.is_dir():
                shutil.copytree(there, here)
    if not (folders.config / "entry.json").is_file():
        write_defaults(folders, Subject(source="transforms", path=str(scene.folder)))  # nothing reads it from here on
    return folders
