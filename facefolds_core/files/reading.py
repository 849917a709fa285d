"""Files of users and of earlier stages, opened only if they are regular files: nothing hangs, nothing runs.

A FIFO, a socket or a device in place of a file would block or never end; it is refused by what `stat` says of it,
without being opened.
"""

from __future__ import annotations

import errno
import os
import stat
from functools import partial
from pathlib import Path

from facefolds_core.errors import UserError

LARGEST = 1 << 30
"""Bytes of a text, mesh or picture; larger ones are not read into memory."""

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a FIFO"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_MISSING = {errno.ENOENT: "nothing", errno.ENOTDIR: "a file where a folder should be"}
_ODD = {
    errno.ELOOP: "symbolic links in a loop",
    errno.ENAMETOOLONG: "a name that is too long for this file system",
    errno.EACCES: "no permission to look there",
}
_WIDE = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}

STAGE_OUTPUTS: dict[str, tuple[str, ...]] = {
    "capture": ("capture",),
    "normalize": ("scene",),
    "subject": ("subject",),
    "train": ("model", "training"),
    "sample": ("samples",),
    "reconstruct": ("surfaces",),
    "decimate": ("meshes",),
    "texture": ("resampled",),
    "bake": ("textures",),
    "compress": ("asset", "asset.glb"),
    "evaluate": ("evaluation", "metrics.json"),
}
"""What each stage leaves in data/<subject>, in the order in which they run."""
_STAGE_OF = {name: stage for stage, names in STAGE_OUTPUTS.items() for name in names} | {"config": "configure"}


def remake(path: str | Path) -> str:
    """The remedy for a damaged file of our own, data/SUBJECT/FOLDER/NAME: which stage makes it again."""
    folder = Path(path).parent
    stage = _STAGE_OF.get(folder.name)
    target = f" {stage}@{folder.parent.name}" if stage and folder.parent.name else ""
    return f"delete it and run `dvc repro{target}`, which makes it again"


def no_memory(path: str | Path, place: str | None = None) -> UserError:
    """For a file that is too large for the memory that is left."""
    return UserError(
        "memory ran out",
        file=path,
        place=place,
        remedy="close other programs, or use a machine with more memory, and run it again; the file may be sound",
    )


def is_regular(path: Path) -> bool:
    """Whether there is a regular file (or a link to one) of this name; False for names that cannot be."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError):  # ValueError: a NUL in the name
        return False


def is_folder(path: Path) -> bool:
    """Whether there is a folder (or a link to one) of this name; False for names that cannot be."""
    try:
        return stat.S_ISDIR(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def is_there(path: Path) -> bool:
    """Whether there is anything of this name, even a broken link; False for names that cannot be."""
    return os.path.lexists(path) if "\0" not in str(path) else False


def check_regular(
    path: Path, remedy: str, *, place: str | None = None, missing: str = "file not found", largest: int | None = None
) -> int:
    """The length in bytes of a regular file.

    Args:
        place: of the file in the capture, for the message.
        missing: the message where there is nothing.
        largest: more bytes are refused.

    Raises:
        UserError: if it is missing, anything else than a regular file, or too large.
    """
    wrong = partial(UserError, file=path, place=place, remedy=remedy)
    try:
        found = path.stat()
    except OSError as error:
        if error.errno in _MISSING:
            raise wrong(missing) from None
        words = _ODD.get(error.errno or 0, error.strerror)
        raise wrong("cannot open a file", found=words) from None
    except ValueError:
        raise wrong("cannot open a file", file=repr(str(path)), found="a NUL") from None
    if not stat.S_ISREG(found.st_mode):
        kind = next((words for test, words in _KINDS if test(found.st_mode)), "something else")
        raise wrong("not a file", expected="a regular file", found=kind) from None
    if largest is not None and found.st_size > largest:
        raise wrong("the file is too large", expected=f"at most {largest} bytes", found=f"{found.st_size} bytes")
    return found.st_size


def check_folder(path: Path, remedy: str) -> None:
    """Refuse anything that stands where a folder should be; nothing at all is fine."""
    if is_there(path) and not is_folder(path):
        found = "a file" if is_regular(path) else "something else, or a link to nothing"
        raise UserError("not a folder", file=path, expected="a folder", found=found, remedy=remedy)


def read_bytes(path: Path, remedy: str, *, place: str | None = None, missing: str = "file not found") -> bytes:
    """All bytes of a regular file.

    Raises:
        UserError: as `check_regular`; if it may not be read, or the disk fails.
    """
    check_regular(path, remedy, place=place, missing=missing, largest=LARGEST)
    try:
        return path.read_bytes()
    except MemoryError:
        raise no_memory(path, place) from None
    except OSError as error:
        if error.errno == errno.ENOMEM:
            raise no_memory(path, place) from None
        words = "no permission" if error.errno == errno.EACCES else "cannot read a file"
        raise UserError(words, file=path, place=place, found=error.strerror, remedy=remedy) from None


def read_text(path: Path, remedy: str, *, expected: str) -> str:
    """The text of a regular file in UTF-8, with or without a byte order mark (which is taken off).

    Args:
        expected: what the file should be, for the message.

    Raises:
        UserError: as `read_bytes`; if it is not UTF-8.
    """
    data = read_bytes(path, remedy)
    wide = _WIDE.get(data[:2])
    if wide is not None:
        raise UserError(
            "a text in another encoding",
            file=path,
            expected=f"{expected} in UTF-8",
            found=wide,
            remedy="save it as UTF-8 in your editor; " + remedy,
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(
            "not a text file", file=path, place=f"byte {error.start}", expected=f"{expected} in UTF-8", remedy=remedy
        ) from None
