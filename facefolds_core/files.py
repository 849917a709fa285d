"""Write whole files only: everything goes to a temporary name beside its target and is moved into place at the end."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from facefolds_core.errors import UserError


@contextmanager
def atomic_file(target: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `target`; rename it to `target` on success, delete it on failure.

    The temporary name keeps the suffix of `target`, because several libraries choose the format by it.
    """
    target = Path(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(target: str | Path) -> Iterator[Path]:
    """Yield a temporary folder beside `target`; on success it replaces `target` whole, on failure it is deleted.

    What a killed run left behind under a temporary name is deleted first: one process at a time may write `target`.
    """
    target = Path(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    for leftover in target.parent.glob(f".{target.name}-????????"):
        shutil.rmtree(leftover, ignore_errors=True)
    temporary = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        yield temporary
        temporary.chmod(0o755)
        if target.exists():
            shutil.rmtree(target)
        temporary.replace(target)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def write_text(target: str | Path, text: str) -> None:
    with atomic_file(target) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(target: str | Path, value: Any) -> None:
    """Write `value` as indented JSON. NaN and infinity are refused (ValueError): they are never a valid result."""
    write_text(target, json.dumps(value, indent=1, allow_nan=False) + "\n")


def read_json(path: str | Path, remedy: str = "make the file again, or restore it from a backup") -> Any:
    """Parse a JSON file.

    Raises:
        UserError: if the file is missing, is not UTF-8 or is not JSON; names the line and column.
    """
    path = Path(path)
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError("file not found", file=path, remedy=remedy) from None
    except UnicodeDecodeError as error:
        raise UserError(
            "not a text file", file=path, place=f"byte {error.start}", expected="JSON in UTF-8", remedy=remedy
        ) from None
    except json.JSONDecodeError as error:
        raise UserError(
            "garbled JSON",
            file=path,
            place=f"line {error.lineno}, column {error.colno}",
            expected="valid JSON",
            found=error.msg,
            remedy=remedy,
        ) from None


def file_sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes."""
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
