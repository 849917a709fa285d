"""The one exception for mistakes that a user can mend.

Anything that a user's file, parameter or disk can cause is raised as `UserError`; the stages print it without a
traceback and exit with status 1. Every other exception is a defect of ours and keeps its traceback.
"""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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
        lines = [self.message]
        fields = [
            ("file", self.file),
            ("place", self.place),
            ("expected", self.expected),
            ("found", self.found),
            ("remedy", self.remedy),
        ]
        lines += [f"  {name + ':':<10}{value}" for name, value in fields if value is not None]
        return "\n".join(lines)


def disk_error(error: OSError, path: str | Path) -> UserError:
    """The `UserError` for an `OSError` met while writing `path` (disk full, no permission, read-only, ...)."""
    remedies = {
        errno.ENOSPC: "free some space on that disk and run the same command again; finished stages are kept",
        errno.EDQUOT: "your disk quota is used up; free some space and run the same command again",
        errno.EACCES: "give yourself permission to read and write there, or work in another folder",
        errno.EROFS: "the file system is read-only; work in another folder",
    }
    return UserError(
        "no permission" if error.errno == errno.EACCES else "cannot write a file",
        file=path,
        found=error.strerror or str(error),
        remedy=remedies.get(error.errno or 0, "check the disk and run the same command again"),
    )


@contextmanager
def report_user_errors(what: str) -> Iterator[None]:
    """Turn a `UserError` (or a full disk, or a missing permission) inside the block into a message and exit status 1.

    Args:
        what: the name of the command or stage, printed before the message.
    """
    try:
        yield
    except UserError as error:
        sys.stderr.write(f"\n{what}: error: {error}\n")
        sys.exit(1)
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES):
            raise
        sys.stderr.write(f"\n{what}: error: {disk_error(error, error.filename or '(unknown)')}\n")
        sys.exit(1)
