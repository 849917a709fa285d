"""Gaussians in PLY files, as 3DGS, gsplat, nerfstudio, OpenSplat and Postshot write them.

A file has an element `vertex` with x y z, f_dc_0..2, opacity, scale_0..2 and rot_0..3, and mostly f_rest_0..: spherical
harmonics of degree 1 to 3, all of red first. Degree 1 is kept, what is above is dropped; normals are passed over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files.reading import read_bytes
from facefolds_core.files.writing import atomic_file
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, SHINE, TURN, Splats

Array = NDArray[np.float32]

REMEDY = "export the Gaussians again as an uncompressed PLY of 3D Gaussian splatting"
FLAT, TILTED = 0.28209479177387814, 0.4886025119029199
"""Spherical harmonics of degree 0; of degree 1 in shares of y, z and x, the first and the last negative."""
MEANS, SCALES = ("x", "y", "z"), ("scale_0", "scale_1", "scale_2")
TURNS, COLOURS = ("rot_0", "rot_1", "rot_2", "rot_3"), ("f_dc_0", "f_dc_1", "f_dc_2")
NEEDED = (*MEANS, *COLOURS, "opacity", *SCALES, *TURNS)
RESTS = (0, 9, 24, 45)
"""Numbers of f_rest for degrees 0 to 3."""
LARGEST_LOG, LARGEST_PLACE = 40.0, 1e9
"""Of |log scale|, and of |position|."""
TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class _Header:
    """What a file says of itself.

    Attributes:
        order: "<", ">", or "" for text.
        count: of Gaussians.
        properties: names and numpy's types.
        begin: byte at which the numbers begin.
        last: whether nothing comes after them.
    """

    order: str
    count: int
    properties: tuple[tuple[str, str], ...]
    begin: int
    last: bool


def read_ply(path: str | Path) -> Splats:
    """Gaussians of a file, in its own coordinates, before black.

    Raises:
        UserError: if it is missing, damaged, compressed, or lacks what a Gaussian needs.
    """
    path = Path(path)
    data = read_bytes(path, REMEDY, missing="no such file of Gaussians")
    header = _header(path, data)
    names = [name for name, _ in header.properties]
    missing = [name for name in NEEDED if name not in names]
    if missing:
        packed = any("packed" in name for name in names)
        words = "compressed Gaussians cannot be read" if packed else "the PLY lacks properties of Gaussians"
        raise UserError(words, file=path, expected=" ".join(NEEDED), found=f"no {' '.join(missing)}", remedy=REMEDY)
    table = _table(path, data, header)
    rest = sum(name.startswith("f_rest_") for name in names)
    if rest not in RESTS or not {f"f_rest_{k}" for k in range(rest)} <= set(names):
        expected = "0, 9, 24 or 45 f_rest, numbered from 0 on"
        raise UserError("odd spherical harmonics", file=path, expected=expected, found=f"{rest}", remedy=REMEDY)
    values = _values(table, rest)
    _check(path, values)
    return Splats(values, np.zeros(3, np.float32))


def _header(path: Path, data: bytes) -> _Header:
    """What stands before the numbers.

    Raises:
        UserError: if it is no PLY file, or has no element `vertex` or something before it.
    """
    end = data.find(b"end_header", 0, 1 << 16)
    begin = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or begin == 0:
        found = repr(data[:12])
        raise UserError("not a PLY file", file=path, expected="`ply` ... `end_header`", found=found, remedy=REMEDY)
    order, elements, properties = None, list[tuple[str, int]](), list[tuple[str, str]]()
    for number, line in enumerate(data[:end].decode("latin-1").split("\n"), 1):
        words = line.split() or ["comment"]
        try:
            if words[0] == "format":
                order = ORDERS[words[1]]
            elif words[0] == "element":
                elements.append((words[1], int(words[2])))
            elif words[0] == "property" and elements[-1][0] == "vertex":
                properties.append((words[2], TYPES[words[1]]))
            elif words[0] not in ("ply", "comment", "obj_info", "property"):
                raise ValueError
        except (IndexError, KeyError, ValueError):
            place, found = f"line {number}", line[:80].strip()
            raise UserError("garbled PLY header", file=path, place=place, found=found, remedy=REMEDY) from None
    if order is None or not elements or elements[0][0] != "vertex" or elements[0][1] < 0:
        names = ", ".join(name for name, _ in elements) or "no element"
        expected = "a format, and `vertex` as the first element"
        raise UserError("no Gaussians in the PLY", file=path, expected=expected, found=names, remedy=REMEDY)
    if len({name for name, _ in properties}) < len(properties):
        raise UserError("a property twice in the PLY", file=path, remedy=REMEDY)
    return _Header(order, elements[0][1], tuple(properties), begin, len(elements) == 1)


def _table(path: Path, data: bytes, header: _Header) -> dict[str, NDArray[np.float64]]:
    """Column by column."""
    expected = f"{header.count} Gaussians"
    if header.count == 0:
        raise UserError("a PLY without Gaussians", file=path, remedy=REMEDY)
    if header.order:
        row = np.dtype([(name, header.order + kind) for name, kind in header.properties])
        found, over = divmod(len(data) - header.begin, row.itemsize)
        if found < header.count or (header.last and (found > header.count or over)):
            words = "the PLY is cut off" if found < header.count else "the PLY is longer than it says"
            raise UserError(words, file=path, expected=expected, found=f"bytes of {found}", remedy=REMEDY)
        rows = np.frombuffer(data, row, header.count, header.begin)
        return {name: rows[name].astype(np.float64) for name, _ in header.properties}
    lines = [line for line in data[header.begin :].split(b"\n") if line.strip()]
    if len(lines) < header.count or (header.last and len(lines) > header.count):
        words = "the PLY is cut off" if len(lines) < header.count else "the PLY is longer than it says"
        raise UserError(words, file=path, expected=expected, found=f"{len(lines)} lines", remedy=REMEDY)
    try:
        numbers = np.array([line.split() for line in lines[: header.count]], np.float64)
        if numbers.shape != (header.count, len(header.properties)):
            raise ValueError(f"{numbers.shape[-1]} numbers a line")
    except ValueError as error:
        place = f"{len(header.properties)} numbers a line"
        raise UserError("garbled PLY", file=path, expected=place, found=str(error)[:200], remedy=REMEDY) from None
    return {name: numbers[:, k] for k, (name, _) in enumerate(header.properties)}


def _values(table: dict[str, NDArray[np.float64]], rest: int) -> Array:
    """(N, COLUMNS)."""
    values = np.zeros((len(table["x"]), COLUMNS), np.float32)
    with np.errstate(over="ignore"):
        for columns, names in ((MEAN, MEANS), (SCALE, SCALES), (TURN, TURNS)):
            values[:, columns] = np.stack([table[name] for name in names], 1)
        values[:, OPACITY] = table["opacity"]
        values[:, COLOUR] = 0.5 + FLAT * np.stack([table[name] for name in COLOURS], 1)
        shine = np.zeros((len(values), 3, 3))
        for q in range(3 if rest else 0):
            along_y, along_z, along_x = (TILTED * table[f"f_rest_{q * rest // 3 + k}"] for k in range(3))
            shine[:, :, q] = np.stack([-along_x, -along_y, along_z], 1)
        values[:, SHINE] = shine.reshape(-1, 9)
    return values


def _check(path: Path, values: Array) -> None:
    """Refuse what no picture can be drawn of."""
    bad = ~np.isfinite(values).all(1) & ~(np.abs(values[:, OPACITY]) == math.inf)
    bad |= (np.abs(values[:, MEAN]) > LARGEST_PLACE).any(1) | (np.abs(values[:, SCALE]) > LARGEST_LOG).any(1)
    bad |= ~(np.abs(values[:, TURN]).max(1) > 0)
    if bad.any():
        place = f"Gaussian {int(np.argmax(bad))}"
        raise UserError(
            f"{int(bad.sum())} of {len(bad)} Gaussians have numbers that are none",
            file=path,
            place=place,
            expected="finite positions, logarithms of sizes and colours, quaternions that are not 0",
            remedy=REMEDY,
        )
    values[:, OPACITY] = np.clip(values[:, OPACITY], -30, 30)


def write_ply(path: str | Path, splats: Splats) -> None:
    """Write Gaussians with spherical harmonics of degree 1, little endian; what is behind them is not written."""
    rests = [f"f_rest_{k}" for k in range(9)]
    names = [*MEANS, "nx", "ny", "nz", *COLOURS, *rests, "opacity", *SCALES, *TURNS]
    rows = np.zeros((len(splats), len(names)), "<f4")
    at = {name: k for k, name in enumerate(names)}
    values = splats.values
    for columns, group in ((MEAN, MEANS), (SCALE, SCALES), (TURN, TURNS)):
        rows[:, at[group[0]] : at[group[-1]] + 1] = values[:, columns]
    rows[:, at["opacity"]] = values[:, OPACITY]
    rows[:, at["f_dc_0"] : at["f_dc_2"] + 1] = (values[:, COLOUR] - 0.5) / FLAT
    shine = values[:, SHINE].reshape(-1, 3, 3) / TILTED
    for q in range(3):
        for k, along in enumerate((-shine[:, 1, q], shine[:, 2, q], -shine[:, 0, q])):
            rows[:, at[f"f_rest_{3 * q + k}"]] = along
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(splats)}"]
    lines += [*(f"property float {name}" for name in names), "end_header", ""]
    with atomic_file(path) as temporary:
        temporary.write_bytes("\n".join(lines).encode() + rows.tobytes())
