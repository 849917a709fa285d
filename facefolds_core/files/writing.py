"""Write whole files only: everything goes to a temporary folder beside its target and is moved into place at the end.

The temporary folder, `.facefolds-temporary-XXXXXXXX`, holds

- `facefolds-temporary`: marks it as ours, and is locked by the process that writes, for as long as it lives;
- `new/NAME`: what becomes the target NAME;
- `old/NAME`: the folder that NAME was, between the two renamings that replace it.

A process that is killed leaves it behind. Whoever writes beside it next sees that the mark is locked no more, puts
`old/NAME` back where NAME is missing, and deletes the rest. What carries no mark is never deleted.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import Any

from facefolds_core.errors import UserError
from facefolds_core.files.parsing import parse_json
from facefolds_core.files.reading import read_text
from facefolds_core.system.locks import try_lock

PREFIX = ".facefolds-temporary-"
MARK = "facefolds-temporary"


@contextmanager
def atomic_file(target: str | Path) -> Iterator[Path]:
    """Yield a temporary path; rename it to `target` on success, delete it on failure.

    Its name is that of `target`, because several libraries choose the format by it. The file gets the mode that the
    umask asks for, whoever wrote it.

    Raises:
        UserError: if `target` is there and is no file.
    """
    target = _place_of(target)
    if os.path.lexists(target) and not target.is_file() and not (target.is_symlink() and not target.exists()):
        raise UserError(
            "a file is to be written where something else lies",
            file=target,
            expected="a file, or nothing",
            found="a folder" if target.is_dir() else "a device, pipe or socket",
            remedy="name another file, or move away what lies there",
        )
    with _errors_name(target), _workplace(target) as (_, temporary):
        temporary.touch()
        mode = temporary.stat().st_mode & 0o777
        yield temporary
        temporary.chmod(mode)
        temporary.replace(target)


@contextmanager
def atomic_folder(target: str | Path) -> Iterator[Path]:
    """Yield a temporary folder; on success it replaces `target` whole, on failure it is deleted.

    A kill at any moment leaves a whole old or a whole new folder, at `target` or where the next one to write beside it
    finds it and puts it back.

    Raises:
        UserError: if `target` is there and is no folder of its own: a file, a link, a mount point, the working
            directory or one that it lies in.
    """
    target = _place_of(target)
    _check_replaceable(target)
    with _errors_name(target), _workplace(target) as (folder, temporary):
        temporary.mkdir()
        yield temporary
        _check_replaceable(target)
        if not target.exists():
            temporary.replace(target)
            return
        aside = folder / "old" / target.name
        aside.parent.mkdir()
        target.replace(aside)
        temporary.replace(target)  # if this fails, _settle puts the old one back


def _check_replaceable(target: Path) -> None:
    found = None
    if target.is_symlink():
        found = f"a link to {target.readlink()}"
    elif target.exists() and not target.is_dir():
        found = "a file" if target.is_file() else "a device, pipe or socket"
    elif Path.cwd().is_relative_to(target.resolve()):
        found = "the working directory, or a folder that it lies in"
    elif target.is_mount():
        found = "a mount point"
    if found:
        raise UserError(
            "a folder is to be replaced, and what lies there is not one that can be",
            file=target,
            expected="a folder, or nothing",
            found=found,
            remedy="name another folder, or move away what lies there",
        )


def _place_of(target: str | Path) -> Path:
    """`target` as an absolute path that ends in its name; the folder that it lies in is made."""
    # Not resolve(): a link is looked at as it is.
    path = Path(os.path.abspath(target))  # noqa: PTH100
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


@contextmanager
def _workplace(target: Path) -> Iterator[tuple[Path, Path]]:
    """(a temporary folder of ours beside `target`, the path in it that becomes `target`)."""
    clear_temporaries(target.parent)
    folder, lock = _marked_folder(target.parent)
    try:
        temporary = folder / "new" / target.name
        temporary.parent.mkdir()
        yield folder, temporary
    finally:
        with suppress(OSError):
            _settle(folder)
        lock.close()


def _marked_folder(parent: Path) -> tuple[Path, FileIO]:
    """A new folder that is marked as ours, and its mark, locked."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
        # Another process that clears up may have had it before it was marked and locked.
        with suppress(FileNotFoundError):
            lock = try_lock(folder / MARK)
            if lock is not None and (folder / MARK).exists():
                return folder, lock


def clear_temporaries(parent: Path) -> None:
    """Delete what killed processes left in `parent`: marked as ours, locked by nobody. What they moved is put back."""
    for folder in parent.glob(f"{PREFIX}????????"):
        if folder.is_symlink() or not folder.is_dir():
            continue
        with suppress(OSError):
            if not (folder / MARK).is_file():
                folder.rmdir()  # killed before it was marked; what is not empty stays
                continue
            lock = try_lock(folder / MARK, create=False)
            if lock is None:
                continue
            try:
                _settle(folder)
            finally:
                lock.close()


def _settle(folder: Path) -> None:
    """Put back what was moved aside and not replaced; delete the rest of a temporary folder, its mark last.

    Raises:
        OSError: if something cannot be moved or deleted; it then stays, marked, for the next one.
    """
    for aside in folder.glob("old/*"):
        if not os.path.lexists(folder.parent / aside.name):
            aside.replace(folder.parent / aside.name)
    for part in (folder / "new", folder / "old"):
        if part.exists():
            shutil.rmtree(part)
    (folder / MARK).unlink()
    folder.rmdir()


@contextmanager
def _errors_name(target: Path) -> Iterator[None]:
    """Errors of the disk name the file that is to be, not nothing and not the temporary path."""
    try:
        yield
    except UserError as error:
        if error.file is not None:
            error.file = Path(_final(str(error.file), target))
        raise
    except OSError as error:
        if error.errno is None or isinstance(error.filename, int):
            raise
        name = _final(os.fsdecode(error.filename or ""), target) or str(target)
        try:
            error.filename = name
        except AttributeError:  # PyAV's name of the file cannot be changed
            raise OSError(error.errno, error.strerror, name) from error
        raise


def _final(name: str, target: Path) -> str:
    """A path inside the temporary folder of `target` -> where it will lie; others as they are."""
    start = f"{target.parent}{os.sep}{PREFIX}"
    if not name.startswith(start):
        return name
    inside = Path(name.removeprefix(start)).parts[3:]
    return str(target.joinpath(*inside))


def write_text(target: str | Path, text: str) -> None:
    with atomic_file(target) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(target: str | Path, value: Any) -> None:
    """Write `value` as indented JSON. NaN and infinity are refused (ValueError): they are never a valid result."""
    write_text(target, json.dumps(value, indent=1, allow_nan=False) + "\n")


def read_json(path: str | Path, remedy: str = "make the file again, or restore it from a backup") -> Any:
    """Parse a JSON file, with or without a byte order mark.

    Raises:
        UserError: if it is missing, no regular file, not UTF-8 or not JSON (parsing.py); names the line and column.
    """
    return parse_json(read_text(Path(path), remedy, expected="JSON"), path, remedy)


def file_sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes."""
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
