"""Whether what stands in a file's place is the file that a manifest names: its kind, its length, its checksum."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from functools import lru_cache
from pathlib import Path

from facefolds_core.asset.manifest import REMEDY
from facefolds_core.asset.manifest_base import StoredFile
from facefolds_core.errors import UserError
from facefolds_core.files.writing import file_sha256

MISSING = "the file is missing"


def stored_file(path: Path) -> StoredFile:
    """What a manifest says of a file that has been written."""
    return StoredFile(file=path.name, bytes=path.stat().st_size, sha256=file_sha256(path))


def special_problem(path: Path) -> str | None:
    """Why a path cannot be read as a file, in words; None if it can. Opens nothing: a FIFO would wait for ever."""
    try:
        mode = path.stat().st_mode
        readable = os.access(path, os.R_OK)
    except (OSError, ValueError) as error:
        missing = isinstance(error, OSError) and error.errno in (errno.ENOENT, errno.ENOTDIR)
        return MISSING if missing else f"the file cannot be read: {getattr(error, 'strerror', error)}"
    if stat.S_ISREG(mode):
        return None if readable else "the file cannot be read: no permission"
    return "a folder stands in the file's place" if stat.S_ISDIR(mode) else "no file, but a device, a pipe or a socket"


def check_file(path: Path, size: int, sha256: str) -> str | None:
    """What is wrong with a file against the manifest's byte count and checksum, in words; None if it is whole."""
    problem = special_problem(path)
    if problem:
        return problem
    try:
        found = path.stat().st_size
        if found != size:
            difference = "truncated" if found < size else "too long"
            return f"the file has {found} bytes, the manifest says {size}: {difference}"
        if file_sha256(path) != sha256:
            return "the file's SHA-256 is not the manifest's: its content was changed"
    except OSError as error:
        return f"the file cannot be read: {error.strerror}"
    return None


def refuse_changed(folder: Path, file: StoredFile) -> None:
    """Check a file again before it is decoded. Without another read where its inode says that nothing was written.

    Raises:
        UserError: if it is not (or no longer) what the manifest says.
    """
    path = folder / file.file
    try:
        status = path.stat()
        inode = (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
        problem = _checked(path, file.bytes, file.sha256, inode)
    except (OSError, ValueError):
        problem = special_problem(path) or "the file cannot be read"
    if problem:
        raise UserError("damaged asset", file=path, found=problem, remedy=REMEDY)


def read_slice(path: Path, offset: int, size: int, sha256: str) -> bytes:
    """Some bytes of a file, checked.

    Raises:
        UserError: if they are not (or no longer) what the manifest says.
    """
    try:
        with path.open("rb") as file:
            file.seek(offset)
            data = file.read(size)
    except OSError as error:
        found = f"the file cannot be read: {error.strerror}"
        raise UserError("damaged asset", file=path, found=found, remedy=REMEDY) from None
    if hashlib.sha256(data).hexdigest() != sha256:
        found = f"the SHA-256 of the {size} bytes from byte {offset} on is not the manifest's"
        raise UserError("damaged asset", file=path, found=found, remedy=REMEDY)
    return data


@lru_cache(maxsize=64)
def _checked(path: Path, size: int, sha256: str, _: tuple[int, ...]) -> str | None:
    return check_file(path, size, sha256)


def leads_out(folder: Path, name: str) -> bool:
    """Whether a link stands in a file's place and leads out of the folder: a copy of the folder would lack it."""
    path = folder / name
    try:
        return path.is_symlink() and not path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # RuntimeError: links in a circle, until Python 3.12
        return False
