"""Videos that are encoded part by part: each a closed group of pictures, by itself.

A part that was encoded of the same before is taken over, from this run or an earlier one: in a long take of which some
frames changed, only their parts are encoded. Then packets are copied into one file; nothing is encoded twice.
"""

from __future__ import annotations

import hashlib
import shutil
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.codecs import Codec
from facefolds_core.asset.regions import Regions, nowhere
from facefolds_core.asset.video import FORMATS, Picture, encode_video
from facefolds_core.files.writing import atomic_file

PICTURES_AHEAD = 2
"""That are made on a thread of their own while one is encoded."""


@dataclass
class Parts:
    """Where encoded parts are kept, and which of them this run asked for.

    Attributes:
        folder: of the files, named by what they are made of.
        common: digest of the code that makes pictures.
        used: names of those that this run asked for.
    """

    folder: Path
    common: bytes
    used: set[str] = field(default_factory=set)

    def path(self, digest: str, codec: Codec) -> Path:
        """Of a part, whether it is there or not."""
        name = f"{digest}.{codec.container}"
        self.used.add(name)
        return self.folder / name

    def tidy(self) -> None:
        """Remove the parts that this run did not ask for."""
        for path in self.folder.iterdir() if self.folder.is_dir() else ():
            if path.name not in self.used and path.is_file():
                path.unlink()


@dataclass(frozen=True)
class Filmed:
    """Pictures to encode.

    Attributes:
        picture: k -> the planar picture; may be asked for on several threads.
        sources: k -> arrays that the picture is made of, cheaper to have than the picture.
        size: (width, height).
        rate: frames a second.
        made: all else that the pictures depend on, in words.
        regions: coded finer or coarser.
    """

    picture: Callable[[int], Picture]
    sources: Callable[[int], Iterable[NDArray[Any]]]
    size: tuple[int, int]
    rate: Fraction
    made: str
    regions: Regions = nowhere

    def digest(self, parts: Parts, frames: range, codec: Codec, options: dict[str, str]) -> str:
        """Of what a part's file depends on."""
        libraries = sorted(av.library_versions.items())
        said = (
            self.made,
            tuple(self.regions(frames)),
            self.size,
            self.rate,
            codec.name,
            codec.encoder,
            sorted(options.items()),
            libraries,
        )
        found = hashlib.blake2b(parts.common + repr(said).encode(), digest_size=16)
        for k in frames:
            for array in self.sources(k):
                found.update(np.ascontiguousarray(array).data)
        return found.hexdigest()


def encode_parts(
    path: Path, filmed: Filmed, borders: Sequence[int], codec: Codec, options: dict[str, str], parts: Parts
) -> None:
    """Encode pictures into one file.

    Args:
        borders: numbers of the pictures that parts begin with, and of that after the last.
        options: of the encoder; a group of pictures may not be shorter than a part.

    Raises:
        UserError: if the encoder refuses.
    """
    parts.folder.mkdir(parents=True, exist_ok=True)

    def part(frames: range) -> Path:
        found = parts.path(filmed.digest(parts, frames, codec, options), codec)
        if not found.exists():
            with atomic_file(found) as temporary:
                pictures = _ahead(filmed.picture, frames)
                regions = filmed.regions(frames)
                encode_video(temporary, pictures, filmed.size, filmed.rate, codec, options, regions)
        return found

    files = [part(range(first, after)) for first, after in pairwise(borders)]
    if len(files) == 1:
        shutil.copyfile(files[0], path)
    else:
        _join(path, files, filmed.rate, codec)


def _ahead(make: Callable[[int], Picture], frames: Iterable[int]) -> Iterator[Picture]:
    """Pictures in their order; the next ones are made meanwhile."""
    with ThreadPoolExecutor(1) as pool:
        waiting = deque[Future[Picture]]()
        for k in frames:
            waiting.append(pool.submit(make, k))
            if len(waiting) > PICTURES_AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _join(path: Path, files: Sequence[Path], rate: Fraction, codec: Codec) -> None:
    """One file of the parts' packets, numbered through."""
    muxer = {"fflags": "bitexact"} | ({"movflags": "faststart"} if codec.container == "mp4" else {})
    with ExitStack() as open_files:
        first = open_files.enter_context(_opened(files[0], codec))
        out: Any = open_files.enter_context(av.open(str(path), "w", format=codec.container, options=muxer))
        copy = out.add_stream_from_template(first.streams.video[0], opaque=True)
        copy.time_base = 1 / rate
        header = bytes(first.streams.video[0].codec_context.extradata or b"")
        for number, packet in enumerate(_packets(files, codec, header)):
            packet.time_base, packet.pts, packet.dts, packet.duration = 1 / rate, number, number, 1
            packet.stream = copy
            out.mux(packet)


def _packets(files: Sequence[Path], codec: Codec, header: bytes) -> Iterator[Any]:
    for file in files:
        with _opened(file, codec) as source:
            stream = source.streams.video[0]
            if bytes(stream.codec_context.extradata or b"") != header:
                raise ValueError(f"{file}: the encoder describes parts of one video differently")
            yield from (packet for packet in source.demux(stream) if packet.size)


def _opened(file: Path, codec: Codec) -> Any:
    return av.open(f"file:{file}", format=FORMATS[codec.container])
