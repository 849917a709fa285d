"""Files of Gaussians: what is written comes back, other programs' layouts are read, faults are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.subject.ply import NEEDED, read_ply, write_ply
from facefolds_core.subject.splats import COLOUR, MEAN, OPACITY, SCALE, SHINE, TURN
from tests.subject.splats import some


def header(names: list[str], count: int, form: str = "ascii", kind: str = "float") -> bytes:
    lines = ["ply", f"format {form} 1.0", "comment by hand", f"element vertex {count}"]
    return "\n".join([*lines, *(f"property {kind} {name}" for name in names), "end_header", ""]).encode()


def row(names: list[str], **values: float) -> list[float]:
    known = {"rot_0": 1.0, **values}
    return [known.get(name, 0.0) for name in names]


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    splats = some(20)
    write_ply(tmp_path / "a.ply", splats)
    np.testing.assert_allclose(read_ply(tmp_path / "a.ply").values, splats.values, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("rest", [0, 9, 24, 45])
def test_layouts_of_other_programs(tmp_path: Path, form: str, rest: int) -> None:
    names = ["x", "y", "z", "nx", *(f"f_rest_{k}" for k in range(rest)), *NEEDED[3:]]
    values = {"x": 1.0, "y": 2.0, "z": 3.0, "f_dc_1": 1.0, "opacity": 0.5, "scale_2": -3.0, "rot_3": 0.5}
    if rest:  # red along y, green along x
        values |= {"f_rest_0": -1.0, f"f_rest_{rest // 3 + 2}": -2.0}
    numbers = np.array([row(names, **values)] * 2)
    kind = "double" if form == "binary_big_endian" else "float"
    if form == "ascii":
        body = "\n".join(" ".join(map(str, one)) for one in numbers).encode()
    else:
        body = numbers.astype(">f8" if kind == "double" else "<f4").tobytes()
    path = tmp_path / "a.ply"
    path.write_bytes(header(names, 2, form, kind) + body)
    found = read_ply(path).values[1]
    np.testing.assert_allclose(found[MEAN], [1, 2, 3])
    np.testing.assert_allclose(found[COLOUR], [0.5, 0.5 + 0.28209479, 0.5], atol=1e-6)
    np.testing.assert_allclose(found[SCALE], [0, 0, -3])
    np.testing.assert_allclose(found[TURN], [1, 0, 0, 0.5])
    assert found[OPACITY] == 0.5
    shine = found[SHINE].reshape(3, 3)  # along x, y, z
    expected = np.array([[0, 2, 0], [1, 0, 0], [0, 0, 0]]) * (0.4886025 if rest else 0)
    np.testing.assert_allclose(shine, expected, atol=1e-6)


def text(names: list[str], *rows: list[float], count: int | None = None) -> bytes:
    body = "\n".join(" ".join(map(str, one)) for one in rows)
    return header(names, len(rows) if count is None else count) + body.encode()


ALL = list(NEEDED)
FAULTS: dict[str, tuple[bytes, str]] = {
    "no PLY": (b"solid thing", "not a PLY file"),
    "no end": (b"ply\nformat ascii 1.0\n", "not a PLY file"),
    "a mesh": (text(["x", "y", "z"], [0, 0, 0]), "lacks properties"),
    "compressed": (text(["packed_position", "packed_color"], [0, 0]), "compressed"),
    "nobody": (text(ALL), "without Gaussians"),
    "garbled": (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "garbled PLY header"),
    "a list": (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int x\nend_header\n1 1", "garbled"),
    "no format": (b"ply\nelement vertex 1\nproperty float x\nend_header\n1", "no Gaussians"),
    "faces first": (b"ply\nformat ascii 1.0\nelement face 1\nelement vertex 1\nend_header\n1", "no Gaussians"),
    "cut off": (text(ALL, row(ALL), count=2), "cut off"),
    "longer": (text(ALL, row(ALL), row(ALL), count=1), "longer"),
    "words": (text(ALL, row(ALL)).replace(b"0.0", b"naught", 1), "garbled PLY"),
    "short line": (text(ALL, row(ALL)[:-1]), "garbled PLY"),
    "NaN": (text(ALL, row(ALL, x=float("nan"))), "numbers that are none"),
    "huge": (text(ALL, row(ALL, scale_1=100.0)), "numbers that are none"),
    "no axes": (text(ALL, row(ALL, rot_0=0.0)), "numbers that are none"),
    "odd harmonics": (text([*ALL, "f_rest_0"], [*row(ALL), 0.0]), "odd spherical harmonics"),
    "twice": (text([*ALL, "x"], [*row(ALL), 0.0]), "twice"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults(tmp_path: Path, name: str) -> None:
    data, words = FAULTS[name]
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    with pytest.raises(UserError, match=words):
        read_ply(path)


def test_a_binary_file_that_is_cut_off(tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", some(20))
    data = (tmp_path / "a.ply").read_bytes()
    for wrong, words in ((data[:-7], "cut off"), (data + b"1234", "longer")):
        (tmp_path / "b.ply").write_bytes(wrong)
        with pytest.raises(UserError, match=words):
            read_ply(tmp_path / "b.ply")
    with pytest.raises(UserError, match="no such file"):
        read_ply(tmp_path / "none.ply")
