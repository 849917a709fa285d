"""Damage that keeps a file's form: other values, other lines, something else in the file's place."""

from __future__ import annotations

import json
import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.hostile.damage import MUTATIONS

WORDS = (
    *("nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "0", "-1"),
    *("", "word", "1_000", "1e", "99999999999999999999", "\u0661"),
)
VALUES: tuple[Any, ...] = (
    *(float("nan"), float("inf"), 1e300, -1e300, 1e-300, 1e-12, 0, -1, 1 << 40, 10**400, True, False, None),
    *("", "1.5", "word", "\0", "x" * 300, "../..", "/dev/zero", [], {}, [[1, 2], [3]], [1] * 16),
)


def damage_bytes(path: Path, random: np.random.Generator) -> str:
    """One of `MUTATIONS`."""
    mutation = MUTATIONS[int(random.integers(len(MUTATIONS)))]
    path.write_bytes(mutation(path.read_bytes(), random))
    return mutation.__name__


def damage_json(path: Path, random: np.random.Generator) -> str:
    """One of its values, see `damage_values`."""
    value: Any = json.loads(path.read_text())
    words = damage_values(value, random)
    path.write_text(json.dumps(value))
    return words


def damage_lines(path: Path, random: np.random.Generator) -> str:
    """Lines dropped, doubled or swapped, a word replaced, the file in another encoding or with other line ends."""
    lines = path.read_text().splitlines()
    at = int(random.integers(max(1, len(lines))))
    way = int(random.integers(9))
    data: bytes | None = None
    if way == 0:
        del lines[at : at + int(random.integers(1, 9))]
    elif way == 1:
        lines[at:at] = lines[at : at + int(random.integers(1, 9))]
    elif way == 2:
        other = int(random.integers(len(lines)))
        lines[at], lines[other] = lines[other], lines[at]
    elif way <= 5:
        words = lines[at].split() or [""]
        words[int(random.integers(len(words)))] = str(random.choice(WORDS))
        lines[at] = " ".join(words)
    elif way == 6:
        data = "\n".join(lines).encode("utf-16")
    elif way == 7:
        data = "\r\n".join(lines).encode("utf-8-sig")
    else:
        lines[at] += "\0" + "9" * 5000
    path.write_bytes("\n".join(lines).encode() + b"\n" if data is None else data)
    return f"lines {way} at {at}"


def damage_values(value: Any, random: np.random.Generator) -> str:
    """Replace, drop or double one value somewhere in parsed JSON, in place."""
    way, place = value, ""
    while True:
        keys: list[Any] = list(way) if isinstance(way, dict) else list(range(len(way)))
        key = keys[int(random.integers(len(keys)))]
        place += f"[{key!r}]"
        if isinstance(way[key], dict | list) and len(way[key]) and random.random() < 0.9:
            way = way[key]
            continue
        kind = int(random.integers(6))
        if kind == 0:
            del way[key]
        elif kind == 1 and isinstance(way, list):
            way.insert(key, way[key])
        else:
            chosen = int(random.integers(len(VALUES)))
            way[key] = VALUES[chosen]
            place += f" = VALUES[{chosen}]"
        return f"{place}, {kind}"


def damage_path(path: Path, random: np.random.Generator) -> str:
    """Something else in the file's place: see `ODD`; or an EPS, or a file where its folder was."""
    way = str(random.choice([*ODD, "eps", "parent"]))
    if way == "parent" and path.parent.parent.name != "":
        shutil.rmtree(path.parent)
        path.parent.write_bytes(b"a file where a folder was")
        return way
    path.unlink()
    if way == "eps":
        path.write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 40 64\nshowpage\n%%EOF\n")
    elif way in ODD:
        ODD[way](path)
    return way


def _socket(path: Path) -> None:
    """A socket's file; its name may be too long for bind, so it is made beside and moved."""
    short = Path(f"/tmp/hostile-{os.getpid()}")
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(short))
    shutil.move(short, path)


ODD: dict[str, Callable[[Path], object]] = {
    "nothing": lambda path: None,
    "FIFO": os.mkfifo,
    "socket": _socket,
    "device": lambda path: path.symlink_to("/dev/null"),  # /dev/zero would take all memory of a reader that is fooled
    "folder": Path.mkdir,
    "loop": lambda path: path.symlink_to(path.name),
    "link to nothing": lambda path: path.symlink_to("nowhere"),
}
"""What may lie where a file should be, and how it is put there."""
