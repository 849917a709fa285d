"""Seeded damage to bytes, texts and folders, and what a command makes of it: what the hostile tests have in common."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from facefolds_core.errors import UserError
from tests.hostile.watch import within

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


def differing(one: dict[str, str], other: dict[str, str]) -> list[str]:
    """Sorted names of the files whose digests are not the same in both."""
    return sorted(name for name in {*one, *other} if one.get(name) != other.get(name))


@dataclass
class Counts:
    """What a run of one fuzzer found. `fuzz_AREA.py` has `run(count, seed, folder) -> Counts`: the tests call it with a
    small count, `python -m tests.hostile` with a large one.

    Attributes:
        tried: damaged inputs, or kills.
        accepted, refused: of these.
        crashed, hung, harmed, kept_wrong: a line for each defect: an exception that is no `UserError`; no end in the
            time allowed; a file changed outside the command's own outputs; a wrong result taken for a good one.
    """

    tried: int = 0
    accepted: int = 0
    refused: int = 0
    crashed: list[str] = field(default_factory=list)
    hung: list[str] = field(default_factory=list)
    harmed: list[str] = field(default_factory=list)
    kept_wrong: list[str] = field(default_factory=list)

    @property
    def defects(self) -> list[str]:
        return [*self.crashed, *self.hung, *self.harmed, *self.kept_wrong]

    def add(self, what: str, result: Outcome) -> None:
        """Count one outcome; `what` tells how to repeat it: seed, file, damage."""
        self.tried += 1
        if result.kind == "crashed":
            self.crashed.append(f"{what}: {result.text}")
        elif result.kind == "refused":
            self.refused += 1
        else:
            self.accepted += 1


def attempt(counts: Counts, what: str, seconds: float, call: Callable[[], Any]) -> tuple[Outcome, list[Any]]:
    """Call, within a time; count what became of it, and return that, and what was returned if anything was."""
    found: list[Any] = []
    result = outcome(within(seconds, lambda: found.append(call())))
    if "TimeoutError" in result.text:
        counts.tried += 1
        counts.hung.append(what)
    else:
        counts.add(what, result)
    return result, found
