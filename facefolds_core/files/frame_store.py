"""Images of one size in one Arrow file, memory-mapped: never one file a picture. Plain, or packed without loss.

Keyed by (index, frame): what the index counts is the caller's, cameras of a scene or layers of an asset.

Columns: `camera` int32 (the index, whatever it counts), `frame` int32, `pixels` fixed-size binary of H*W*C bytes
(row-major, RGB or one channel). Height, width and channels stand in the schema's metadata. Rows may come in any order
and need not be complete (masks exist for some images only). A packed file has a column more,
`after` int32: `pixels` is Zstandard of the difference from the image of the same index in that frame, or, where it is
-1, of each byte's difference from that of the pixel before in its row.
"""

from __future__ import annotations

import errno
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from threading import local

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from facefolds_core.errors import UserError, disk_error, is_disk_error
from facefolds_core.files.reading import check_regular, no_memory, remake
from facefolds_core.files.writing import atomic_file

Image = NDArray[np.uint8]

PACKING = "zstd"
"""Of packed files, in their metadata."""

RUN = 12
"""Images that hang together, at most: who looks at a single one unpacks so many."""

NAMES = ("camera", "frame", "pixels", "after")


def _types(size: int, packed: bool) -> list[pa.DataType]:
    """Of the columns."""
    return [pa.int32(), pa.int32(), *([pa.binary(), pa.int32()] if packed else [pa.binary(size)])]


def write_frames(
    path: str | Path, shape: tuple[int, int, int], rows: Iterable[tuple[int, int, Image]], packed: bool = False
) -> None:
    """Write images, streaming: one at a time is held in memory.

    Args:
        shape: (height, width, channels) of every image.
        rows: (index, frame, image uint8 of `shape`).
        packed: smaller, without loss; to be read in order, frame by frame or index by index.
    """
    size = shape[0] * shape[1] * shape[2]
    metadata = {name: str(n) for name, n in zip(("height", "width", "channels"), shape, strict=True)}
    if packed:
        metadata["packing"] = PACKING
    schema = pa.schema(list(zip(NAMES, _types(size, packed), strict=False)), metadata=metadata)
    packer = Packer()
    with (
        atomic_file(path) as temporary,
        pa.OSFile(str(temporary), "wb") as sink,
        pa.ipc.new_file(sink, schema) as writer,
    ):
        for index, frame, image in rows:
            if image.shape != shape or image.dtype != np.uint8:
                raise ValueError(f"image of {image.dtype} {image.shape}, expected uint8 {shape}")
            columns = [pa.array([index], pa.int32()), pa.array([frame], pa.int32())]
            if packed:
                after, pixels = packer.pack(index, frame, image)
                columns += [pa.array([pixels], pa.binary()), pa.array([after], pa.int32())]
            else:
                plain = pa.py_buffer(np.ascontiguousarray(image))
                columns.append(pa.FixedSizeBinaryArray.from_buffers(pa.binary(size), 1, [None, plain]))
            writer.write_batch(pa.record_batch(columns, schema=schema))


@dataclass(frozen=True)
class Places:
    """Where the images lie in a file: numbers alone, since a take has as many images as it has frames and cameras.

    Attributes:
        keys: (M,) int64, sorted: index * 2^32 + frame.
        offsets, sizes: (M,) int64, bytes of what is stored of each.
        after: (M,) int32, frame that it is the difference from; -1 if it stands alone.
    """

    keys: NDArray[np.int64]
    offsets: NDArray[np.int64]
    sizes: NDArray[np.int64]
    after: NDArray[np.int32]

    def find(self, index: int, frame: int) -> int:
        """Row of an image, -1 without one."""
        if min(index, frame) < 0 or max(index, frame) >> 32:
            return -1
        key = index << 32 | frame
        row = int(np.searchsorted(self.keys, key))
        return row if row < len(self.keys) and self.keys[row] == key else -1

    def pairs(self) -> list[tuple[int, int]]:
        """All (index, frame), sorted."""
        return list(zip((self.keys >> 32).tolist(), (self.keys & 0xFFFFFFFF).tolist(), strict=True))

    def part(self, frames: Sequence[int]) -> Places:
        """Those of some frames, numbered anew from 0 on."""
        known = {frame: position for position, frame in enumerate(frames)}
        rows = [(i << 32 | known[k], row) for row, (i, k) in enumerate(self.pairs()) if k in known]
        rows.sort()
        keys, taken = np.array([key for key, _ in rows], np.int64), np.array([row for _, row in rows], np.intp)
        return Places(keys, self.offsets[taken], self.sizes[taken], self.after[taken])


class _Last(local):
    """The image of each index that was unpacked last, on each thread: threads read at different places."""

    def __init__(self) -> None:
        self.images: dict[int, tuple[int, Image]] = {}


class FrameStore:
    """Read-only, memory-mapped view of a file of `write_frames`.

    Attributes:
        height, width, channels: of every image.

    Raises:
        UserError: if the file is missing, not a regular file, damaged, or memory ran out.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        check_regular(self.path, remake(path))
        try:
            self._file = pa.memory_map(str(path), "r").read_buffer()
            reader = pa.ipc.open_file(self._file)
            meta = {k.decode(): v.decode() for k, v in (reader.schema.metadata or {}).items()}
            shape = (int(meta["height"]), int(meta["width"]), int(meta["channels"]))
            if meta.get("packing", PACKING) != PACKING:
                raise ValueError(f"packed by {meta['packing']!r}")
            self._packed = "packing" in meta
            self._places = _places(reader, self._file, shape, self._packed)
        except MemoryError:  # Arrow's own too
            raise no_memory(path) from None
        except (pa.ArrowException, KeyError, ValueError, TypeError, OverflowError, OSError) as error:
            if is_disk_error(error):
                raise (no_memory(path) if error.errno == errno.ENOMEM else disk_error(error, path)) from None
            raise UserError("damaged frame store", file=path, found=str(error), remedy=remake(path)) from None
        self.height, self.width, self.channels = shape
        self._last = _Last()

    def __contains__(self, key: tuple[int, int]) -> bool:
        return self._places.find(*key) >= 0

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """All (index, frame) that the file holds, sorted."""
        return iter(self.keys())

    def keys(self) -> list[tuple[int, int]]:
        """All (index, frame) that the file holds, sorted."""
        return self._places.pairs()

    def part(self, frames: Sequence[int]) -> FrameStore:
        """Some of the frames, numbered anew from 0 on, of the same mapped file."""
        if self._packed:
            raise ValueError("a part of a packed store")  # its images hang together
        found = copy(self)
        found._places = self._places.part(frames)
        return found

    def image(self, index: int, frame: int) -> Image:
        """(height, width, channels) uint8: of a plain file a view of it.

        Raises:
            UserError: if the file does not hold it, or it is damaged.
        """
        row = self._places.find(index, frame)
        if row < 0:
            place = f"index {index} (camera or layer), frame {frame}"
            raise UserError(
                "an image is missing in a frame store", file=self.path, place=place, remedy=remake(self.path)
            )
        if self._packed:
            return self._unpacked(index, frame)
        size = self.height * self.width * self.channels
        plain = np.frombuffer(self._file, np.uint8, count=size, offset=int(self._places.offsets[row]))
        return plain.reshape(self.height, self.width, self.channels)

    def _unpacked(self, index: int, frame: int) -> Image:
        """An image, by way of those that it is a difference from; the last one of each index is kept."""
        shape, places = (self.height, self.width, self.channels), self._places
        last, image = self._last.images.get(index, (-1, None))
        chain: list[int] = []
        at = frame
        while at >= 0 and at != last:
            chain.append(places.find(index, at))
            at = int(places.after[chain[-1]])
        image = image if at >= 0 else None
        try:
            for row in reversed(chain):
                data = self._file.slice(int(places.offsets[row]), int(places.sizes[row]))
                image = unpacked(data, shape, image)
        except (pa.ArrowException, ValueError, OSError) as error:
            raise UserError(
                "damaged frame store",
                file=self.path,
                place=f"index {index}, frame {frame}",
                found=str(error),
                remedy=remake(self.path),
            ) from None
        assert image is not None
        image.flags.writeable = False
        self._last.images[index] = (frame, image)
        return image


def _places(reader: pa.RecordBatchFileReader, file: pa.Buffer, shape: tuple[int, int, int], packed: bool) -> Places:
    """Where the images lie in the mapped file.

    Raises:
        ValueError, ArrowException: if it is not what `write_frames` writes.
    """
    size = shape[0] * shape[1] * shape[2]
    if min(shape) < 1 or reader.schema.types != _types(size, packed):
        raise ValueError(f"columns {reader.schema.types} are no images of {shape}")
    count = reader.num_record_batches
    keys, offsets, sizes = (np.empty(count, np.int64) for _ in range(3))
    after = np.full(count, -1, np.int32)
    for row in range(count):
        batch = reader.get_batch(row)
        batch.validate(full=True)
        pixels = batch.column("pixels")
        if len(batch) != 1 or any(column.null_count for column in batch.columns) or pixels.offset:
            raise ValueError("a batch that is not one image")
        index, frame = batch.column("camera")[0].as_py(), batch.column("frame")[0].as_py()
        if min(index, frame) < 0:
            raise ValueError(f"an image of index {index}, frame {frame}")
        keys[row], data = index << 32 | frame, pixels.buffers()[1]
        offsets[row], sizes[row] = data.address - file.address, size
        if packed:
            after[row] = batch.column("after")[0].as_py()
            first, last = np.frombuffer(data, np.int32, count=2)
            offsets[row], sizes[row] = pixels.buffers()[2].address - file.address + int(first), int(last - first)
    if not ((offsets >= 0) & (offsets + sizes <= file.size)).all():
        raise ValueError("images that do not lie in the file")  # compressed by another writer
    order = np.argsort(keys)
    places = Places(keys[order], offsets[order], sizes[order], after[order])
    if count and not (np.diff(places.keys) > 0).all():
        raise ValueError("an image twice")
    chained = places.after >= 0
    before = (places.keys[chained] >> 32 << 32) + places.after[chained]
    found = np.minimum(np.searchsorted(places.keys, before), max(count - 1, 0))
    if not ((places.keys[found] == before) & (order[found] < order[chained])).all() or (places.after < -1).any():
        raise ValueError("an image after one that does not come before it")
    return places


def unpacked(data: pa.Buffer, shape: tuple[int, int, int], before: Image | None) -> Image:
    """The image of what `Packer` made of it.

    Args:
        before: the image that it is the difference from, None if it stands alone.

    Raises:
        ValueError, ArrowException: if the data are damaged.
    """
    flat = pa.decompress(data, shape[0] * shape[1] * shape[2], PACKING)
    difference = np.frombuffer(flat, np.uint8).reshape(shape)
    if before is None:
        return np.cumsum(difference, axis=1, dtype=np.uint8)
    return np.asarray(before + difference, np.uint8)


class Packer:
    """Packs the images of any number of indices, each in the order of its frames: neighbours differ little."""

    def __init__(self) -> None:
        self._last: dict[int, tuple[int, Image]] = {}
        self._run: dict[int, int] = {}

    def pack(self, index: int, frame: int, image: Image) -> tuple[int, bytes]:
        """The frame whose image it is the difference from, or -1; and the packed difference."""
        after, before = self._last.get(index, (-1, image))
        self._run[index] = run = (self._run.get(index, 0) + 1) % RUN if 0 <= after < frame else 0
        if run == 0:
            after, difference = -1, image.copy()
            difference[:, 1:] -= image[:, :-1]  # wraps around, as the sum does
        else:
            difference = image - before
        self._last[index] = (frame, image.copy())
        packed: bytes = pa.compress(np.ascontiguousarray(difference).data, PACKING, asbytes=True)
        return after, packed
