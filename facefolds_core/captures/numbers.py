"""Numbers of a capture's files: arrays of NumPy, and matrices in JSON."""

from __future__ import annotations

import io
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.values import is_number, short
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import HUGE
from facefolds_core.reading import read_bytes


def read_npy(path: Path, remedy: str) -> NDArray[np.float64]:
    """Finite numbers of a .npy file, without pickles.

    Raises:
        UserError: if it is missing, damaged, or has anything but finite numbers.
    """
    data = read_bytes(path, remedy)
    try:
        values = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
        numbers = np.asarray(values, np.float64)
    except (ValueError, EOFError, TypeError, OSError, SyntaxError, MemoryError, OverflowError) as error:
        raise UserError(
            "garbled numbers", file=path, expected="an array of numpy.save", found=str(error)[:200], remedy=remedy
        ) from None
    if not (np.abs(numbers) <= HUGE).all():
        expected = f"finite numbers, none above {HUGE:g}"
        raise UserError("numbers beyond sense", file=path, expected=expected, found="others", remedy=remedy)
    return numbers


def matrix_from(
    value: Any, shapes: Collection[tuple[int, int]], path: Path, place: str, remedy: str
) -> NDArray[np.float64]:
    """A matrix of JSON: rows of finite numbers.

    Args:
        shapes: what it may be.

    Raises:
        UserError: for anything else.
    """
    words = " or ".join(f"{rows} x {columns}" for rows, columns in shapes)
    rows = value if isinstance(value, list) and all(isinstance(row, list) for row in value) else []
    if (len(rows), len(rows[0]) if rows else 0) not in shapes or len({len(row) for row in rows}) != 1:
        raise UserError(
            "a matrix of the wrong shape", file=path, place=place, expected=words, found=short(value), remedy=remedy
        )
    for number in [number for row in rows for number in row]:
        if not is_number(number) or not abs(number) <= HUGE:
            raise UserError(
                "a matrix with something that is no number",
                file=path,
                place=place,
                expected=f"finite numbers, none above {HUGE:g}",
                found=short(number),
                remedy=remedy,
            )
    return np.array(rows, np.float64)
