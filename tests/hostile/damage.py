"""Seeded damage to bytes, texts and folders, and what a command makes of it: what the hostile tests have in common."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from facefolds_core.errors import UserError

Mutation = Callable[[bytes, np.random.Generator], bytes]


def flip_bits(content: bytes, random: np.random.Generator) -> bytes:
    """One to eight bits flipped anywhere."""
    data = bytearray(content)
    for position in random.integers(max(1, 8 * len(data)), size=int(random.integers(1, 9))):
        if data:
            data[position // 8] ^= 1 << (position % 8)
    return bytes(data)


def truncate(content: bytes, random: np.random.Generator) -> bytes:
    """Cut off anywhere, possibly at nothing."""
    return content[: int(random.integers(0, max(1, len(content))))]


def zero_tail(content: bytes, random: np.random.Generator) -> bytes:
    """The length kept, the tail zeros: an interrupted copy."""
    keep = int(random.integers(0, max(1, len(content))))
    return content[:keep] + bytes(len(content) - keep)


def zero_block(content: bytes, random: np.random.Generator) -> bytes:
    """Up to 4096 bytes anywhere zeroed: a lost block."""
    start = int(random.integers(0, max(1, len(content))))
    stop = min(len(content), start + int(random.integers(1, 4097)))
    return content[:start] + bytes(stop - start) + content[stop:]


def repeat_part(content: bytes, random: np.random.Generator) -> bytes:
    """A part written twice."""
    start, stop = sorted(int(i) for i in random.integers(0, len(content) + 1, size=2))
    return content[:stop] + content[start:stop] + content[stop:]


def garbage(content: bytes, random: np.random.Generator) -> bytes:
    """Other bytes of the same length."""
    return random.bytes(len(content))


def empty(content: bytes, random: np.random.Generator) -> bytes:
    """Nothing left."""
    return b""


MUTATIONS: tuple[Mutation, ...] = (flip_bits, truncate, zero_tail, zero_block, repeat_part, garbage, empty)


@dataclass(frozen=True)
class Outcome:
    """What became of one damaged input.

    Attributes:
        kind: "accepted", "refused" (a clear `UserError`), or "crashed" (any other exception: a defect).
        text: of the error; "" if accepted.
    """

    kind: Literal["accepted", "refused", "crashed"]
    text: str = ""


def outcome(call: Callable[[], object]) -> Outcome:
    """Call; every exception but `UserError` is a defect, and is told apart."""
    try:
        call()
    except UserError as error:
        return Outcome("refused", str(error))
    except Exception as error:
        return Outcome("crashed", f"{type(error).__name__}: {error}")
    return Outcome("accepted")


def fingerprint(folder: Path) -> dict[str, str]:
    """Each file below `folder` -> SHA-256; links and special files -> what they are. Shows what a command touched."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink():
            found[name] = f"link to {path.readlink()}"
        elif path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            found[name] = "folder" if path.is_dir() else "special"
    return found
