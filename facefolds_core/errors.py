"""The one exception for mistakes that a user can mend.

Anything that a user's file, parameter or disk can cause is raised as `UserError`; the stages print it without a
traceback and exit with status 1. Every other exception is a defect of ours and keeps its traceback.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import sysconfig
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeGuard


class UserError(Exception):
    """A mistake in the input, with what is needed to mend it.

    Args:
        message: what is wrong, in a few words.
        file: the file (or folder) concerned.
        place: where in it: a line, a camera, a frame, a key.
        expected: what should have been there.
        found: what was there.
        remedy: what the user can do.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        place: str | None = None,
        expected: object | None = None,
        found: object | None = None,
        remedy: str | None = None,
    ) -> None:
        self.message = message
        self.file = None if file is None else Path(file)
        self.place = place
        self.expected = expected
        self.found = found
        self.remedy = remedy
        super().__init__(str(self))

    def __str__(self) -> str:
        fields = {name: getattr(self, name) for name in ("file", "place", "expected", "found", "remedy")}
        lines = [f"  {name + ':':<10}{value}" for name, value in fields.items() if value is not None]
        return "\n".join([self.message, *lines])


_AGAIN = "and run the same command again; finished stages are kept"

_DISK = {
    errno.ENOSPC: ("the disk is full", f"free some space on that disk {_AGAIN}"),
    errno.EDQUOT: ("your disk quota is used up", f"free some space {_AGAIN}"),
    errno.EFBIG: ("a file became larger than is allowed here", f"raise the limit (`ulimit -f`) {_AGAIN}"),
    errno.EACCES: ("no permission", "give yourself permission to read and write there, or work in another folder"),
    errno.EPERM: ("not permitted", "give yourself permission to read and write there, or work in another folder"),
    errno.EROFS: ("the file system is read-only", "work in another folder"),
    errno.EIO: ("the disk does not work", "look at the disk (`dmesg`), copy what is on it elsewhere and work there"),
    errno.ESTALE: ("the network drive was lost", f"mount it {_AGAIN}"),
    errno.ENOTCONN: ("the network drive was lost", f"mount it {_AGAIN}"),
    errno.EBUSY: ("something else uses it", f"end what uses it, or unmount it, {_AGAIN}"),
    errno.ETXTBSY: ("something else uses it", f"end what uses it {_AGAIN}"),
    errno.EISDIR: ("a folder lies where a file is expected", "move the folder away, or name another file"),
    errno.ENOTDIR: ("a file lies where a folder is expected", "move the file away, or name another folder"),
    errno.ELOOP: ("links that lead to each other", "put a folder or file in the place of the link"),
    errno.ENAMETOOLONG: ("the name is too long for this disk", "use a shorter name, or a folder with a shorter path"),
    errno.EXDEV: ("a part of the folder lies on another disk", "unmount it, or work in another folder"),
    errno.EMFILE: ("too many open files", f"raise the limit (`ulimit -n 4096`) {_AGAIN}"),
    errno.ENFILE: ("too many open files on this machine", f"end other programs {_AGAIN}"),
    errno.ENOMEM: ("not enough memory", f"end other programs {_AGAIN}"),
    errno.ENODEV: ("the file cannot be read from this disk", "copy it to another disk"),
    errno.ENXIO: ("not a file that can be read", "put a file in its place"),
}
"""What only a disk, a path or a limit of the user's can cause -> what is wrong, and the remedy."""

_THERE = {
    errno.ENOENT: ("a file or folder is not there", "put it back, or run `dvc repro`, which makes what is missing"),
    errno.EEXIST: ("something lies there already", "move it away, or name another file or folder"),
    errno.ENOTEMPTY: ("something was put into the folder meanwhile", f"leave it alone {_AGAIN}"),
}
"""The same, where it may be a defect of ours as well: the path decides (`_is_users`)."""


def _is_users(error: OSError) -> bool:
    """Whether a user's disk or files can have caused it.

    That something is or is not there is a user's doing where it concerns their files. In what is installed, and in a
    temporary folder of ours that still is there, it is a defect of ours.
    """
    if error.errno in _DISK:
        return True
    if error.errno not in _THERE or not isinstance(error.filename, str | bytes) or not error.filename:
        return False
    path = Path(os.fsdecode(error.filename)).absolute()
    installed = (Path(__file__).parent, *(Path(sysconfig.get_path(name)) for name in ("stdlib", "purelib", "platlib")))
    if any(path.is_relative_to(folder) for folder in installed):
        return False
    temporary = next((folder for folder in (path, *path.parents) if folder.name.startswith(".facefolds-")), None)
    return temporary is None or not temporary.exists()


def is_disk_error(error: BaseException) -> TypeGuard[OSError]:
    """Whether the disk, a permission or a limit caused the error: what is being read is not damaged."""
    return isinstance(error, OSError) and error.errno in _DISK


def disk_error(error: OSError, path: str | Path | None = None) -> UserError:
    """The `UserError` for an `OSError` that a user's disk caused (full, no permission, read-only, ...).

    Args:
        path: concerned; by default what the error names.
    """
    name = path if path is not None else error.filename
    default = ("cannot read or write a file", "check the disk and run the same command again")
    message, remedy = (_DISK | _THERE).get(error.errno or 0, default)
    return UserError(
        message,
        file=os.fsdecode(name) if isinstance(name, str | bytes | Path) and name else None,
        found=error.strerror or str(error),
        remedy=remedy,
    )


def _memory_error(error: BaseException) -> UserError | None:
    """The `UserError` for numpy's, torch's and Python's ways to say that memory is used up; None for others."""
    text = str(error)
    torchs = (
        type(error).__name__ == "OutOfMemoryError" or "can't allocate memory" in text or "not enough memory" in text
    )
    if not isinstance(error, MemoryError) and not (isinstance(error, RuntimeError) and torchs):
        return None
    return UserError(
        "not enough memory",
        found=text.strip().splitlines()[0] if text.strip() else None,
        remedy="end other programs, take fewer frames or smaller resolutions in params.yaml, or a larger machine",
    )


_PARSERS = {"json", "yaml", "ruamel", "tomllib", "xml"}


def _nesting_error(error: BaseException) -> UserError | None:
    """The `UserError` for a text that is nested too deeply to parse; None for recursion of our own."""
    places = [frame.f_code.co_filename for frame, _ in traceback.walk_tb(error.__traceback__)]
    if not isinstance(error, RecursionError) or not any(_PARSERS & set(Path(place).parts) for place in places):
        return None
    return UserError("a file is nested too deeply", expected="JSON or YAML that people can read", remedy="make it anew")


def as_user_error(error: BaseException) -> UserError | None:
    """What a user can mend, as a `UserError`; None if the error is a defect of ours."""
    if isinstance(error, UserError):
        return error
    if isinstance(error, OSError):
        return disk_error(error) if _is_users(error) else None
    return _memory_error(error) or _nesting_error(error)


class Ended(BaseException):
    """The process was asked to end by a signal.

    Args:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(number)


PATIENCE = 5.0
"""Seconds for cleaning up, in which being asked to end again changes nothing."""


@contextmanager
def signals_end_cleanly() -> Iterator[None]:
    """In the block SIGTERM and SIGHUP raise `Ended`, so that temporary files are removed, as Ctrl+C does.

    Only where nobody else handles them, and in the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    last = -PATIENCE

    def handle(number: int, _: object) -> None:
        nonlocal last
        before, last = last, time.monotonic()
        if last - before >= PATIENCE:
            raise Ended(number)

    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    taken = [number for name in names if signal.getsignal(number := getattr(signal, name)) is signal.SIG_DFL]
    for number in taken:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


@contextmanager
def report_user_errors(what: str, ended: str = "") -> Iterator[None]:
    """Turn what a user can mend into a message and exit status 1; Ctrl+C and SIGTERM into a line and 130 and 143.

    A user's mistakes are `UserError`, the disk's and the memory's errors. Every other exception keeps its traceback.

    Args:
        what: the name of the command or stage, printed before the message.
        ended: what else to say where a signal ended it.
    """
    try:
        with signals_end_cleanly():
            yield
    except KeyboardInterrupt:
        sys.stderr.write(f"\n{what}: interrupted; run the same command again to go on\n")
        sys.exit(128 + signal.SIGINT)
    except Ended as error:
        name = signal.Signals(error.number).name
        more = f"; {ended}" if ended else ""
        sys.stderr.write(f"\n{what}: ended by {name}; run the same command again to go on{more}\n")
        sys.exit(128 + error.number)
    except BrokenPipeError as error:
        if error.filename is not None:
            raise
        # Who read the output went away (`| head`); Python must not try to flush it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(128 + signal.SIGPIPE)
    except Exception as error:
        users = as_user_error(error)
        if users is None:
            raise
        sys.stderr.write(f"\n{what}: error: {users}\n")
        sys.exit(1)
