"""Files that OpenCV's `FileStorage` writes: YAML 1.0 with matrices of its own tag, read as plain YAML.

OpenCV's own reader is not used: it prints to the terminal, and says of a damaged file neither line nor key.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.numbers import numbers_from, short
from facefolds_core.errors import UserError
from facefolds_core.files.parsing import parse_yaml
from facefolds_core.files.reading import read_text

REMEDY = "write the calibration again with the tool that made it"


def read_storage(path: Path, missing: str) -> dict[str, Any]:
    """Key -> value of such a file; matrices are mappings {rows, cols, dt, data} still (`matrix_of`).

    Args:
        missing: the remedy where there is no such file.
    """
    text = read_text(path, missing, expected=path.name)
    # "%YAML:1.0" is no directive of any YAML, and the tag tells no more than the mapping itself.
    text = re.sub(r"\A\s*%YAML[^\n]*\n", "\n", text).replace("!!opencv-matrix", "")
    value = parse_yaml(text, path, REMEDY)
    if not isinstance(value, dict):
        raise UserError("not OpenCV's YAML", file=path, expected="keys and matrices", found=short(value), remedy=REMEDY)
    return value


def matrix_of(
    storage: dict[str, Any], key: str, shapes: tuple[tuple[int, int], ...], path: Path
) -> NDArray[np.float64] | None:
    """(rows, cols) of finite numbers, or None where the key is not there."""
    value = storage.get(key)
    if value is None:
        return None

    def refuse(expected: str, found: object) -> UserError:
        return UserError("not a matrix", file=path, place=key, expected=expected, found=found, remedy=REMEDY)

    if not isinstance(value, dict) or not isinstance(value.get("data"), list):
        raise refuse("rows, cols, dt, data", short(value))
    shape, data = (value.get("rows"), value.get("cols")), value["data"]
    if shape not in shapes or len(data) != shape[0] * shape[1]:
        found = f"{shape[0]} x {shape[1]} of {len(data)} numbers"
        raise refuse(" or ".join(f"{rows} x {cols}" for rows, cols in shapes[:3]), found)
    return numbers_from(data, path, key, REMEDY).reshape(shape)


def needed_matrix(
    storage: dict[str, Any], keys: dict[str, tuple[tuple[int, int], ...]], path: Path
) -> NDArray[np.float64]:
    """`matrix_of` the first key that is there; the shapes that each may have are given with it."""
    found = [matrix_of(storage, key, shapes, path) for key, shapes in keys.items() if storage.get(key) is not None]
    if not found or found[0] is None:
        key = next(iter(keys))
        raise UserError("a key is missing", file=path, place=key, expected="a matrix", found="nothing", remedy=REMEDY)
    return found[0]
