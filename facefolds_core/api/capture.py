"""A capture: footage that some layout's reader knows, or the embedded actor's."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from facefolds_core.api.work import new_folders, run, set_params, write_defaults
from facefolds_core.captures import capture as captures
from facefolds_core.captures.looking import describe, look
from facefolds_core.captures.sources import read_capture
from facefolds_core.config.stages import read_stage, read_subject
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.reading import is_there
from facefolds_core.params import CaptureParams, Overrides, Subject, user_error
from facefolds_core.registry import SOURCES

KEYS = sorted({field.alias or name for name, field in Subject.model_fields.items()} - set(Overrides.model_fields))


@dataclass(frozen=True)
class Capture:
    """A capture whose calibration and files have been read, without its pixels.

    Attributes:
        folders: of the work on it.
        source: name of its layout.
        footage: cameras, frames, places of the pictures.
    """

    folders: SubjectFolders
    source: str
    footage: captures.Capture

    def __repr__(self) -> str:
        footage = self.footage
        frames = len(footage.frame_ids)
        rate = f" at {footage.fps:g} a second" if frames > 1 else ""
        size = footage.views[0].camera
        return (
            f"Capture({self.folders.root.name}, {self.source}: {len(footage.views)} cameras, "
            f"{frames} frame{'s' * (frames > 1)}{rate}, {size.width} x {size.height} pixels)"
        )


def load_capture(
    path: str | Path,
    *,
    source: str | None = None,
    name: str | None = None,
    folder: str | Path | None = None,
    **subject: Any,
) -> Capture:
    """Read a capture of any layout that is known; nothing is written beside it.

    Args:
        path: its folder.
        source: name of its layout; None finds out (`facefolds doctor PATH` tells more).
        name: of the subject, which becomes a folder; None takes that of `path`.
        folder: of the work: holds one folder a subject, as `data` does. None takes a temporary one, which goes when
            Python ends.
        subject: keys of a subject, such as `holdout=["A011"]`, `frames={"stop": 20}`, `segment`, `front`
            (docs/guide/subjects.md#keys-of-a-subject).

    Raises:
        UserError: if there is nothing, it is no capture, a key is wrong, or what is there is damaged.
    """
    path = Path(path)
    if not is_there(path):
        raise UserError("nothing there", file=path, expected="the folder of a capture", remedy="correct the path")
    keys: dict[str, Any] = {}
    if source is None:
        source, path, keys = _recognised(path)
    entry = _entry({"source": source, "path": str(path.resolve()), **keys, **subject})
    return _opened(entry, name or _name_of(path), folder)


def film_actor(*, name: str = "actor", folder: str | Path | None = None, holdout: Any = None, **film: Any) -> Capture:
    """Film the embedded actor, a procedural talking head (docs/guide/actor.md).

    Args:
        name, folder: see `load_capture`.
        holdout: names of cameras for scoring only, or {"every": n}; None takes every twelfth.
        film: keys of the section `capture`: `cameras` (24), `frames` (12), `height` (192), `width` (128), ...

    Raises:
        UserError: if a key or a value is wrong.
    """
    here = Path(captures.__file__).parent / "actor"
    held = {} if holdout is None else {"holdout": holdout}
    return _opened(_entry({"source": "actor", "path": str(here), **held}), name, folder, film)


def _recognised(path: Path) -> tuple[str, Path, dict[str, Any]]:
    """Layout, place and keys of a capture.

    Raises:
        UserError: if nothing reads it, or several layouts may be meant.
    """
    found = look(path)
    names = [name for name in SOURCES.names if hasattr(SOURCES[name], "recognise")]
    if len(found) == 1:
        [(source, said)] = found
        return source, said.path, dict(said.keys)
    if found:
        meant = ", ".join(f"{source} ({said.what})" for source, said in found)
        raise UserError(
            "several layouts fit this capture",
            file=path,
            expected="one of them, by its name",
            found=meant,
            remedy=f'say which: load_capture(path, source="{found[0][0]}")',
        )
    what, remedy = describe(path)
    expected = f"a capture of one of the layouts {', '.join(names)}"
    raise UserError("not a capture", file=path, expected=expected, found=what, remedy=remedy)


def _entry(keys: dict[str, Any]) -> Subject:
    wrong = sorted(set(keys) - set(KEYS))
    if wrong:
        raise UserError(
            "no key of a subject",
            place=", ".join(wrong),
            expected=", ".join(KEYS),
            remedy="correct it; parameters of a step are given to the step, as normalize(capture, long_side=512)",
        )
    try:
        return Subject.model_validate(keys)
    except ValidationError as error:
        raise user_error(error, (Subject,), None, "load_capture") from None


def _name_of(path: Path) -> str:
    """A name that a subject may have, like the folder's."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", path.resolve().name).lstrip("-")[:64] or "capture"


def _opened(entry: Subject, name: str, folder: str | Path | None, film: dict[str, Any] | None = None) -> Capture:
    folders = new_folders(name, folder)
    write_defaults(folders, entry)
    set_params(folders, "capture", film or {})
    run("capture", folders)
    footage = read_capture(read_subject(folders.config), folders, read_stage(CaptureParams, folders.config))
    return Capture(folders, entry.source, footage)
