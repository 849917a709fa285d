"""Numbers of a capture's files: arrays of NumPy, and what JSON and YAML hold.

Only what is a number there counts as one, and only up to a sensible size.
"""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from facefolds_core.errors import UserError
from facefolds_core.files.reading import read_bytes
from facefolds_core.geometry.cameras import HUGE, Array


def short(value: Any) -> str:
    """A value for a message; a huge integer is not written out (Python refuses to)."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 1e18:
        return "a huge integer"
    return f"{type(value).__name__} of {len(value)}" if isinstance(value, list | dict) else repr(value)[:80]


def is_number(value: Any) -> bool:
    """Strings and `true` are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def numbers_from(values: Iterable[Any], path: Path, place: str, remedy: str, limit: float = HUGE) -> Array:
    """(n,) finite numbers."""
    values = list(values)
    odd = [value for value in values if not is_number(value) or not abs(value) <= limit]
    if odd:
        expected = f"finite numbers, none above {limit:g}"
        raise UserError("not a number", file=path, place=place, expected=expected, found=short(odd[0]), remedy=remedy)
    return np.array(values, np.float64)


def matrix_from(value: Any, shapes: Collection[tuple[int, int]], path: Path, place: str, remedy: str) -> Array:
    """A matrix of JSON: rows of finite numbers.

    Args:
        shapes: what it may be.
    """
    rows = value if isinstance(value, list) and all(isinstance(row, list) for row in value) else []
    shape = (len(rows), len(rows[0]) if rows else 0)
    if shape not in shapes or len({len(row) for row in rows}) != 1:
        words = " or ".join(f"{count} x {columns}" for count, columns in shapes)
        raise UserError(
            "a matrix of the wrong shape", file=path, place=place, expected=words, found=short(value), remedy=remedy
        )
    return numbers_from([number for row in rows for number in row], path, place, remedy).reshape(shape)


def read_npy(path: Path, remedy: str) -> Array:
    """Finite numbers of a .npy file, without pickles."""
    data = read_bytes(path, remedy)
    try:
        values = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
        numbers = np.asarray(values, np.float64)
    except (ValueError, EOFError, TypeError, OSError, SyntaxError, TokenError, MemoryError, OverflowError) as error:
        raise UserError(
            "garbled numbers", file=path, expected="an array of numpy.save", found=str(error)[:200], remedy=remedy
        ) from None
    if not (np.abs(numbers) <= HUGE).all():
        expected = f"finite numbers, none above {HUGE:g}"
        raise UserError("not a number", file=path, expected=expected, found="others", remedy=remedy)
    return numbers
