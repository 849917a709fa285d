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
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from facefolds_core.errors import UserError, disk_error, is_disk_error
from facefolds_core.files import atomic_file
from facefolds_core.frame_packing import PACKING, Packed, Packer
from facefolds_core.reading import check_regular, no_memory, remake

Image = NDArray[np.uint8]


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
            table = pa.ipc.open_file(pa.memory_map(str(path), "r")).read_all()
            meta = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
            shape = (int(meta["height"]), int(meta["width"]), int(meta["channels"]))
            if meta.get("packing", PACKING) != PACKING:
                raise ValueError(f"packed by {meta['packing']!r}")
            self._images = _views(table, shape, "packing" in meta)
        except MemoryError:  # Arrow's own too
            raise no_memory(path) from None
        except (pa.ArrowException, KeyError, ValueError, TypeError, OverflowError, OSError) as error:
            if is_disk_error(error):
                raise (no_memory(path) if error.errno == errno.ENOMEM else disk_error(error, path)) from None
            raise UserError("damaged frame store", file=path, found=str(error), remedy=remake(path)) from None
        self.height, self.width, self.channels = shape
        self._table = table  # holds the mapped file
        self._last: dict[int, tuple[int, Image]] = {}

    def __contains__(self, key: tuple[int, int]) -> bool:
        return key in self._images

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """All (index, frame) that the file holds, sorted."""
        return iter(self.keys())

    def keys(self) -> list[tuple[int, int]]:
        """All (index, frame) that the file holds, sorted."""
        return sorted(self._images)

    def part(self, frames: Sequence[int]) -> FrameStore:
        """Some of the frames, numbered anew from 0 on, of the same mapped file."""
        if any(not isinstance(image, np.ndarray) for image in self._images.values()):
            raise ValueError("a part of a packed store")  # its images hang together
        known = {frame: position for position, frame in enumerate(frames)}
        found = copy(self)
        found._images = {(i, known[k]): image for (i, k), image in self._images.items() if k in known}
        return found

    def image(self, index: int, frame: int) -> Image:
        """(height, width, channels) uint8: of a plain file a view of it.

        Raises:
            UserError: if the file does not hold it, or it is damaged.
        """
        found = self._images.get((index, frame))
        if found is None:
            place = f"index {index} (camera or layer), frame {frame}"
            raise UserError(
                "an image is missing in a frame store", file=self.path, place=place, remedy=remake(self.path)
            )
        return found if isinstance(found, np.ndarray) else self._unpacked(index, frame)

    def _unpacked(self, index: int, frame: int) -> Image:
        """An image, by way of those that it is a difference from; the last one of each index is kept."""
        shape = (self.height, self.width, self.channels)
        last, image = self._last.get(index, (-1, None))
        chain: list[Packed] = []
        at = frame
        while at >= 0 and at != last:
            chain.append(self._images[index, at])  # type: ignore[arg-type]
            at = chain[-1].after
        image = image if at >= 0 else None
        try:
            for packed in reversed(chain):
                image = packed.image(shape, image)
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
        self._last[index] = (frame, image)
        return image


def _views(table: pa.Table, shape: tuple[int, int, int], packed: bool) -> dict[tuple[int, int], Image | Packed]:
    """(index, frame) -> the image, or what is packed of it, in the mapped file.

    Raises:
        ValueError, ArrowException: if the table is not what `write_frames` writes.
    """
    size = shape[0] * shape[1] * shape[2]
    if min(shape) < 1 or table.schema.types != _types(size, packed):
        raise ValueError(f"columns {table.schema.types} are no images of {shape}")
    images: dict[tuple[int, int], Image | Packed] = {}
    for batch in table.to_batches():
        batch.validate(full=True)
        pixels = batch.column("pixels")
        if len(batch) != 1 or any(column.null_count for column in batch.columns) or pixels.offset:
            raise ValueError("a batch that is not one image")
        key = (batch.column("camera")[0].as_py(), batch.column("frame")[0].as_py())
        if min(key) < 0 or key in images:
            raise ValueError(f"image {key} twice, or none")
        if not packed:
            images[key] = np.frombuffer(pixels.buffers()[1], np.uint8, count=size).reshape(shape)
            continue
        after = batch.column("after")[0].as_py()
        if after != -1 and (key[0], after) not in images:
            raise ValueError(f"image {key} after one that does not come before it")
        first, last = np.frombuffer(pixels.buffers()[1], np.int32, count=2)
        # A scalar of the column would be a copy.
        images[key] = Packed(pixels.buffers()[2].slice(int(first), int(last - first)), after)
    return images
