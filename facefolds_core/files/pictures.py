"""Pictures decoded strictly, PNG and JPEG only (AVIF where it is asked for): the one place where Pillow opens files.

Pillow tries every format that it knows, whatever the file's name: an EPS called x.png would start Ghostscript. And it
is lenient: it skips the checksums of a PNG's pixels and swallows the warnings of its JPEG library. Here:

- PNG: signature, header, every chunk's CRC and the end are checked, and the zlib stream's own checksum is Pillow's:
  any damage to the pixels is found, but for a chance of 2^-32 a chunk.
- JPEG: it has no checksums, so a change of bits that makes another valid picture cannot be found. Found are: a cut
  file (the end marker must be there), segments that do not follow one another, restart markers out of turn, blocks of
  a disk that were never written, and codes that FFmpeg's decoder, told to be strict, cannot decode.
- AVIF: a still of AV1, without checksums; a cut file is found, and what Pillow's decoder cannot decode.

What follows the end of a picture is ignored, as every viewer does.
"""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError, PatchWelcomeError
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import UnidentifiedImageError

from facefolds_core.files.reading import is_regular

FORMATS = ("PNG", "JPEG")
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_DEFLATE = 1040
"""No zlib stream is more than this many times as long when it is unpacked (1032, and some for its ends)."""
_BLOCK = 4096
"""Bytes of a file system's block, and of a page of memory."""
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""PNG's colour types -> values a pixel."""


class DamagedPictureError(ValueError):
    """A picture that is not whole, or none; the text says why."""


def picture_size(file: Path | bytes, formats: Sequence[str] = FORMATS) -> tuple[int, int]:
    """(width, height) from the header of a picture, without decoding it. Only a regular file is opened.

    Args:
        file: a file, or its first bytes.
        formats: some of PNG, JPEG, AVIF, as Pillow names them.

    Raises:
        DamagedPictureError: if it has none. OSError: if the file cannot be read.
    """
    _check_kind(file)
    extents = _avif_extents(file) if isinstance(file, bytes) and "AVIF" in formats else None
    if extents is not None:
        return extents
    with _open(file, formats) as picture:
        return picture.size


def _avif_extents(head: bytes) -> tuple[int, int] | None:
    """(width, height) of an AVIF's first bytes: its box `ispe`; Pillow would want the whole file. None for others."""
    place = head.find(b"ispe")
    if head[4:8] != b"ftyp" or place < 0 or len(head) < place + 16:
        return None
    width, height = struct.unpack_from(">II", head, place + 8)
    return int(width), int(height)


def open_picture(file: Path | bytes, formats: Sequence[str] = FORMATS) -> Pillow.Image:
    """A picture, decoded whole and checked as the module says. Only a regular file is opened.

    Args:
        formats: some of PNG, JPEG, AVIF, as Pillow names them.

    Raises:
        DamagedPictureError: if it is not one, or damaged. OSError: if the file cannot be read.
    """
    _check_kind(file)
    data = file if isinstance(file, bytes) else file.read_bytes()
    with _open(data, formats) as picture:
        if picture.format == "PNG":
            _check_png(data)
        elif picture.format == "JPEG":
            _check_jpeg(data)
        try:
            picture.load()
        except (OSError, SyntaxError, ValueError, struct.error, zlib.error, IndexError) as error:
            raise DamagedPictureError(str(error)) from None
        return picture


def _check_kind(file: Path | bytes) -> None:
    """A FIFO would block until somebody writes into it."""
    if isinstance(file, Path) and file.exists() and not is_regular(file):
        raise DamagedPictureError("not a regular file")


def _open(file: Path | bytes, formats: Sequence[str] = FORMATS) -> Pillow.Image:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return Pillow.open(io.BytesIO(file) if isinstance(file, bytes) else file, formats=tuple(formats))
    except UnidentifiedImageError:
        raise DamagedPictureError(f"no {' or '.join(formats)}") from None
    except Pillow.DecompressionBombError as error:
        raise DamagedPictureError(f"a header beyond sense: {error}") from None
    except (OSError, SyntaxError, ValueError, struct.error, zlib.error, IndexError, KeyError, OverflowError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise  # the system's; Pillow's own, for what is cut off, have no number
        raise DamagedPictureError(str(error) or type(error).__name__) from None


def _check_png(data: bytes) -> None:
    """Walk the chunks: each whole with its CRC, pixels in one run, the end present, room for what the header says."""
    view, position, packed = memoryview(data), len(_SIGNATURE), 0
    kinds: list[bytes] = []
    while not kinds or kinds[-1] != b"IEND":
        if position + 12 > len(data):
            raise DamagedPictureError(f"cut off after {len(data)} bytes: it has no end (IEND)")
        length = int.from_bytes(view[position : position + 4], "big")
        kind, end = bytes(view[position + 4 : position + 8]), position + 8 + length
        if end + 4 > len(data):
            raise DamagedPictureError(f"cut off after {len(data)} bytes, in the chunk {kind!r} at byte {position}")
        if zlib.crc32(view[position + 4 : end]) != int.from_bytes(view[end : end + 4], "big"):
            raise DamagedPictureError(f"wrong checksum of the chunk {kind!r} at byte {position}")
        if kind == b"IDAT":
            packed += length
        if kind != b"IDAT" or kinds[-1:] != [b"IDAT"]:
            kinds.append(kind)
        position = end + 4
    if kinds[0] != b"IHDR" or kinds.count(b"IHDR") != 1 or kinds.count(b"IDAT") != 1:
        raise DamagedPictureError("chunks are missing or out of order")
    width, height, bits, colour = struct.unpack_from(">IIBB", data, len(_SIGNATURE) + 8)
    if width * height * bits * _CHANNELS.get(colour, 1) // 8 > _DEFLATE * packed + 64:
        raise DamagedPictureError(f"{packed} bytes of pixels are too few for {width} x {height}")


def _check_jpeg(data: bytes) -> None:
    """Walk the markers to the end of the picture, then let FFmpeg decode it strictly."""
    end = _jpeg_end(data)
    context = av.CodecContext.create("mjpeg", "r")
    context.options = {"err_detect": "crccheck+bitstream+buffer+explode", "lowres": "3"}
    context.thread_count = 1
    try:
        pictures = [*context.decode(av.Packet(data[:end])), *context.decode(None)]
    except PatchWelcomeError:
        return  # a kind of JPEG that FFmpeg does not decode: its markers must do
    except FFmpegError:
        raise DamagedPictureError("codes that no JPEG has: the file is damaged") from None
    if not pictures:
        raise DamagedPictureError("codes that no JPEG has: the file is damaged")


def _jpeg_end(data: bytes) -> int:
    """Where the picture's last byte is, plus one."""
    codes = np.frombuffer(data, np.uint8)
    found = np.flatnonzero((codes[:-1] == 0xFF) & (codes[1:] != 0) & (codes[1:] != 0xFF))
    position, scans = 2, 0
    while True:
        while data[position : position + 2] == b"\xff\xff":  # fill bytes
            position += 1
        if data[position : position + 1] != b"\xff" or position + 2 > len(data):
            raise DamagedPictureError(f"cut off, or no marker at byte {position} of {len(data)}")
        kind = data[position + 1]
        if kind == 0xD9:
            if scans == 0:
                raise DamagedPictureError("it ends without pixels")
            return position + 2
        if kind <= 1 or 0xD0 <= kind <= 0xD8:
            raise DamagedPictureError(f"a marker where none can be, at byte {position}")
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
        if kind == 0xDA:
            scans += 1
            start, position = position, _scan_end(codes, found, position)
            _check_blocks(codes, start, position)


def _scan_end(codes: NDArray[np.uint8], found: NDArray[np.int64], start: int) -> int:
    """The marker after the codes of a scan that begin at `start`; restart markers must count 0 to 7 in turn.

    Args:
        codes: the file's bytes.
        found: places of all its markers.
    """
    places = found[np.searchsorted(found, start) :]
    kinds = codes[places + 1]
    others = np.flatnonzero((kinds < 0xD0) | (kinds > 0xD7))
    if len(others) == 0:
        raise DamagedPictureError(f"cut off after {len(codes)} bytes: it has no end (EOI)")
    restarts = kinds[: others[0]]
    if not np.array_equal(restarts, 0xD0 + np.arange(len(restarts)) % 8):
        raise DamagedPictureError("restart markers out of turn: a part is missing, or there twice")
    return int(places[others[0]])


def _check_blocks(codes: NDArray[np.uint8], start: int, end: int) -> None:
    """Refuse blocks of zeros in a scan's codes: a copy that was interrupted, or a disk that failed, leaves them.

    Even surfaces may be long runs of zeros, too, where Huffman's codes were made for the picture. But they do not begin
    and end exactly where blocks do: that is chance once in 16 million runs.
    """
    first, last = -(-start // _BLOCK), end // _BLOCK
    empty = np.flatnonzero(~codes[first * _BLOCK : last * _BLOCK].reshape(max(0, last - first), _BLOCK).any(1)) + first
    for run in np.split(empty, np.flatnonzero(np.diff(empty) > 1) + 1) if len(empty) else []:
        begin, stop = int(run[0]) * _BLOCK, int(run[-1] + 1) * _BLOCK
        if codes[begin - 1] and codes[stop]:  # a scan ends with a marker, so `stop` is in the file
            raise DamagedPictureError(f"bytes {begin} to {stop} are zeros: a part was never written")
