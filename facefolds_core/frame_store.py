"""Images of one size in one Arrow file, memory-mapped: never one file a picture.

Keyed by (index, frame): what the index counts is the caller's, cameras of a scene or layers of an asset.

Columns: `camera` int32 (the index, whatever it counts), `frame` int32, `pixels` fixed-size binary of H*W*C bytes
(row-major, RGB or one channel). Height, width and channels stand in the schema's metadata. Rows may come in any order
and need not be complete (masks exist for some images only).
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
from facefolds_core.reading import check_regular, no_memory, remake

Image = NDArray[np.uint8]


def write_frames(path: str | Path, shape: tuple[int, int, int], rows: Iterable[tuple[int, int, Image]]) -> None:
    """Write images, streaming: one at a time is held in memory.

    Args:
        shape: (height, width, channels) of every image.
        rows: (index, frame, image uint8 of `shape`).
    """
    size = shape[0] * shape[1] * shape[2]
    metadata = {name: str(n) for name, n in zip(("height", "width", "channels"), shape, strict=True)}
    fields = [("camera", pa.int32()), ("frame", pa.int32()), ("pixels", pa.binary(size))]
    schema = pa.schema(fields, metadata=metadata)
    with (
        atomic_file(path) as temporary,
        pa.OSFile(str(temporary), "wb") as sink,
        pa.ipc.new_file(sink, schema) as writer,
    ):
        for index, frame, image in rows:
            if image.shape != shape or image.dtype != np.uint8:
                raise ValueError(f"image of {image.dtype} {image.shape}, expected uint8 {shape}")
            pixels = pa.FixedSizeBinaryArray.from_buffers(
                pa.binary(size), 1, [None, pa.py_buffer(np.ascontiguousarray(image))]
            )
            columns = [pa.array([index], pa.int32()), pa.array([frame], pa.int32()), pixels]
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
            meta = {k.decode(): int(v) for k, v in (table.schema.metadata or {}).items()}
            shape = (meta["height"], meta["width"], meta["channels"])
            self._images = _views(table, shape)
        except MemoryError:  # Arrow's own too
            raise no_memory(path) from None
        except (pa.ArrowException, KeyError, ValueError, TypeError, OverflowError, OSError) as error:
            if is_disk_error(error):
                raise (no_memory(path) if error.errno == errno.ENOMEM else disk_error(error, path)) from None
            raise UserError("damaged frame store", file=path, found=str(error), remedy=remake(path)) from None
        self.height, self.width, self.channels = shape
        self._table = table  # holds the mapped file

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
        known = {frame: position for position, frame in enumerate(frames)}
        found = copy(self)
        found._images = {(i, known[k]): image for (i, k), image in self._images.items() if k in known}
        return found

    def image(self, index: int, frame: int) -> Image:
        """(height, width, channels) uint8, a view of the mapped file.

        Raises:
            UserError: if the file does not hold it.
        """
        found = self._images.get((index, frame))
        if found is None:
            place = f"index {index} (camera or layer), frame {frame}"
            raise UserError(
                "an image is missing in a frame store", file=self.path, place=place, remedy=remake(self.path)
            )
        return found


def _views(table: pa.Table, shape: tuple[int, int, int]) -> dict[tuple[int, int], Image]:
    """(index, frame) -> the image's bytes in the mapped file.

    Raises:
        ValueError, ArrowException: if the table is not what `write_frames` writes.
    """
    size = shape[0] * shape[1] * shape[2]
    if min(shape) < 1 or table.schema.types != [pa.int32(), pa.int32(), pa.binary(size)]:
        raise ValueError(f"columns {table.schema.types} are no images of {shape}")
    images: dict[tuple[int, int], Image] = {}
    for batch in table.to_batches():
        batch.validate(full=True)
        pixels = batch.column("pixels")
        if len(batch) != 1 or any(column.null_count for column in batch.columns) or pixels.offset:
            raise ValueError("a batch that is not one image")
        key = (batch.column("camera")[0].as_py(), batch.column("frame")[0].as_py())
        if min(key) < 0 or key in images:
            raise ValueError(f"image {key} twice, or none")
        images[key] = np.frombuffer(pixels.buffers()[1], np.uint8, count=size).reshape(shape)
    return images
