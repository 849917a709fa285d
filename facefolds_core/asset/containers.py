"""What a video's file is, by its first bytes; and whether an MP4's tables can be true, before FFmpeg believes them.

FFmpeg guesses a file's kind by its content, and knows kinds that open other files or addresses (playlists). And it
allots memory for as many pictures as an MP4's tables claim: a header of some hundred bytes can claim 10^9.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

EBML = b"\x1a\x45\xdf\xa3"
DOCTYPE_WEBM = b"\x42\x82\x84webm"
PARENTS = {b"moov", b"trak", b"mdia", b"minf", b"stbl", b"moof", b"traf"}
ENTRY_BYTES = {b"stts": 8, b"ctts": 8, b"stsc": 12, b"stco": 4, b"co64": 8, b"stss": 4}
"""Sizes of the entries of the tables that count them at byte 4."""
DEEPEST = 8
MOST_BOXES = 10_000


class ContainerError(ValueError):
    """A file that is no sound MP4 or WebM; says why."""


def container_of(path: Path) -> Literal["mp4", "webm"]:
    """The kind of a video file.

    Raises:
        ContainerError: if it is neither, or an MP4 whose tables claim more than the file can hold.
        OSError: if it cannot be read.
    """
    with path.open("rb") as file:
        return kind_of(file)


def kind_of(file: BinaryIO, fragments: bool = False) -> Literal["mp4", "webm"]:
    """As `container_of`, of an open file.

    Args:
        fragments: whether an MP4 may be in fragments: its header and those that are wanted.
    """
    head = file.read(64)
    if head.startswith(EBML):
        if DOCTYPE_WEBM not in head:
            raise ContainerError("a Matroska file that is no WebM")
        return "webm"
    if head[4:8] != b"ftyp":
        raise ContainerError("neither an MP4 nor a WebM file")
    if head[8:12] == b"qt  ":
        raise ContainerError("a QuickTime file, no MP4")
    size = file.seek(0, 2)
    _check_boxes(file, size, fragments)
    return "mp4"


def _check_boxes(file: BinaryIO, size: int, fragments: bool) -> None:
    """Walk the boxes of an MP4 of `size` bytes, those of the sample tables with their claims."""
    waiting, boxes = [(0, size, 0)], 0
    while waiting:
        start, stop, depth = waiting.pop()
        for kind, inside, end in _boxes(file, start, stop):
            boxes += 1
            if boxes > MOST_BOXES or depth > DEEPEST:
                raise ContainerError("an MP4 with too many boxes")
            if kind in (b"moof", b"mvex") and not fragments:
                raise ContainerError("an MP4 in fragments")
            if kind in PARENTS:
                waiting.append((inside, end, depth + 1))
            elif kind == b"trun":
                _check_run(file, inside, end, size)
            elif kind in ENTRY_BYTES or kind in (b"stsz", b"stz2"):
                _check_table(file, kind, inside, end, size)


def _boxes(file: BinaryIO, start: int, stop: int) -> Iterator[tuple[bytes, int, int]]:
    """(kind, first byte of its content, one past its last) of each box between two places."""
    while start + 8 <= stop:
        file.seek(start)
        length, kind = struct.unpack(">I4s", file.read(8))
        inside = start + 8
        if length == 1:
            (length,) = struct.unpack(">Q", file.read(8).ljust(8, b"\0"))
            inside += 8
        end = stop if length == 0 else start + length
        if not inside <= end <= stop:
            raise ContainerError(f"its box {kind!r} has {length} bytes where {stop - start} are left")
        yield kind, inside, end
        start = end


def _check_run(file: BinaryIO, inside: int, end: int, size: int) -> None:
    """A run of a fragment (`trun`): flags in bytes 1 to 3 say what stands of each sample."""
    file.seek(inside)
    content = file.read(min(end - inside, 16))
    if len(content) < 8:
        raise ContainerError("its table trun is cut off")
    flags, count = struct.unpack_from(">I", content)[0] & 0xFFFFFF, struct.unpack_from(">I", content, 4)[0]
    header = 8 + 4 * (flags & 1) + 4 * bool(flags & 4)
    entry = 4 * sum(bool(flags & bit) for bit in (0x100, 0x200, 0x400, 0x800))
    if count > size or header + count * entry > end - inside:
        raise ContainerError(f"its table trun claims {count} pictures")


def _check_table(file: BinaryIO, kind: bytes, inside: int, end: int, size: int) -> None:
    """A table holds as many entries as it claims, and no more samples than the file has bytes."""
    file.seek(inside)
    content = file.read(min(end - inside, 1 << 26))
    name = kind.decode()
    if len(content) < (12 if kind in (b"stsz", b"stz2") else 8):
        raise ContainerError(f"its table {name} is cut off")
    if kind in (b"stsz", b"stz2"):
        each, count = struct.unpack_from(">II", content, 4)
        listed = 0 if kind == b"stsz" and each else 4 * count if kind == b"stsz" else count * each // 8
        if count > size or (each > 0 and kind == b"stsz" and each * count > size) or listed > len(content) - 12:
            raise ContainerError(f"its table {name} claims {count} pictures")
        return
    (count,) = struct.unpack_from(">I", content, 4)
    entry = ENTRY_BYTES[kind]
    if count * entry > len(content) - 8:
        raise ContainerError(f"its table {name} claims {count} entries")
    numbers = np.frombuffer(content, ">u4", count * entry // 4, 8).reshape(count, entry // 4)
    total = 0
    if kind in (b"stts", b"ctts"):  # runs of pictures
        total = int(numbers[:, 0].sum(dtype=np.int64))
    elif kind == b"stsc":  # pictures of each chunk
        total = int(numbers[:, 1].max(initial=0))
    if total > size:
        raise ContainerError(f"its table {name} claims {total} pictures")
