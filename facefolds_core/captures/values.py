"""Values of transforms.json: only what is a number in JSON counts as one, and only up to a sensible size."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import HUGE

_REMEDY = "mend transforms.json, or make it again with the tool that wrote it"


def wrong(path: Path, place: str, message: str, expected: object, found: object, remedy: str = _REMEDY) -> UserError:
    """The error for a value that is not what it should be."""
    return UserError(message, file=path, place=place, expected=expected, found=found, remedy=remedy)


def short(value: Any) -> str:
    """A value for a message; a huge integer is not written out (Python refuses to)."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 1e18:
        return "a huge integer"
    return f"{type(value).__name__} of {len(value)}" if isinstance(value, list | dict) else repr(value)[:80]


def is_number(value: Any) -> bool:
    """Strings and `true` are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def json_number(value: Any, path: Path, place: str, limit: float = HUGE) -> float:
    """A finite number.

    Raises:
        UserError: for anything else, and beyond `limit`.
    """
    if not is_number(value) or not abs(value) <= limit:
        raise wrong(path, place, "not a number", f"a finite number, at most {limit:g}", short(value))
    return float(value)


def json_matrix(rows: Any, path: Path, place: str) -> NDArray[np.float64]:
    """(4, 4) or (3, 4) of finite numbers, the last of four rows 0 0 0 1.

    Raises:
        UserError: for anything else.
    """
    shaped = isinstance(rows, list) and len(rows) in (3, 4) and all(isinstance(r, list) and len(r) == 4 for r in rows)
    if not shaped:
        raise wrong(path, place, "a camera matrix of the wrong shape", "4 x 4 numbers", short(rows))
    for number in [number for row in rows for number in row]:
        if not is_number(number):
            raise wrong(path, place, "a camera matrix with something that is no number", "numbers", short(number))
        if not abs(number) <= HUGE:
            problem = "beyond sense" if isinstance(number, int) or math.isfinite(number) else "not finite"
            expected = f"finite numbers, none above {HUGE:g}"
            raise wrong(path, place, f"the camera has numbers that are {problem}", expected, short(number))
    matrix = np.array(rows, dtype=float)
    if len(rows) == 4 and not np.allclose(rows[3], [0, 0, 0, 1]):
        raise wrong(path, place, "a camera matrix whose last row is not 0 0 0 1", "[0, 0, 0, 1]", rows[3])
    return matrix
