"""Images of one size in one Arrow file, memory-mapped: never one file a picture.

Columns: `camera` int32, `frame` int32 (indices into the scene's lists), `pixels` fixed-size binary of H*W*C bytes
(row-major, RGB or one channel). Height, width and channels stand in the schema's metadata. Rows may come in any order
and need not be complete (masks exist for some images only).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file

Image = NDArray[np.uint8]


def write_frames(path: str | Path, shape: tuple[int, int, int], rows: Iterable[tuple[int, int, Image]]) -> None:
    """Write images, streaming: one at a time is held in memory.

    Args:
        shape: (height, width, channels) of every image.
        rows: (camera index, frame index, image uint8 of `shape`).
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
        for camera, frame, image in rows:
            if image.shape != shape or image.dtype != np.uint8:
                raise ValueError(f"image of {image.dtype} {image.shape}, expected uint8 {shape}")
            pixels = pa.FixedSizeBinaryArray.from_buffers(
                pa.binary(size), 1, [None, pa.py_buffer(np.ascontiguousarray(image))]
            )
            columns = [pa.array([camera], pa.int32()), pa.array([frame], pa.int32()), pixels]
            writer.write_batch(pa.record_batch(columns, schema=schema))


class FrameStore:
    """Read-only, memory-mapped view of a file of `write_frames`.

    Attributes:
        height, width, channels: of every image.

    Raises:
        UserError: if the file is missing or damaged.
    """

    def __init__(self, path: str | Path) -> None:
        remedy = "run `dvc repro` to make the normalised scene again"
        try:
            table = pa.ipc.open_file(pa.memory_map(str(path), "r")).read_all()
            meta = {k.decode(): int(v) for k, v in (table.schema.metadata or {}).items()}
            self.height, self.width, self.channels = meta["height"], meta["width"], meta["channels"]
        except FileNotFoundError:
            raise UserError("file not found", file=path, remedy=remedy) from None
        except (pa.ArrowException, KeyError, ValueError, OSError) as error:
            raise UserError("damaged frame store", file=path, found=str(error), remedy=remedy) from None
        self.path = Path(path)
        self._table = table
        self._images: dict[tuple[int, int], Image] = {}
        shape = (self.height, self.width, self.channels)
        cameras, frames = table["camera"].to_pylist(), table["frame"].to_pylist()
        for camera, frame, chunk in zip(cameras, frames, table["pixels"].chunks, strict=True):
            view = np.frombuffer(chunk.buffers()[1], np.uint8, count=shape[0] * shape[1] * shape[2])
            self._images[camera, frame] = view.reshape(shape)

    def __contains__(self, key: tuple[int, int]) -> bool:
        return key in self._images

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """All (camera index, frame index) that the file holds, sorted."""
        return iter(self.keys())

    def keys(self) -> list[tuple[int, int]]:
        """All (camera index, frame index) that the file holds, sorted."""
        return sorted(self._images)

    def image(self, camera: int, frame: int) -> Image:
        """(height, width, channels) uint8, a view of the mapped file."""
        return self._images[camera, frame]
