"""Videos that are encoded part by part: each a closed group of pictures, by itself, so that memory is that of one.

Then packets are copied into one file; nothing is encoded twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from fractions import Fraction
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import av

from facefolds_core.asset.codecs import Codec
from facefolds_core.asset.regions import Region
from facefolds_core.asset.video import FORMATS, Picture, encode_video, written
from facefolds_core.system.threads import in_order


def encode_parts(
    path: Path,
    picture: Callable[[int], Picture],
    borders: Sequence[int],
    size: tuple[int, int],
    rate: Fraction,
    codec: Codec,
    options: dict[str, str],
    regions: Sequence[Region] = (),
) -> None:
    """Encode pictures into one file.

    Args:
        picture: k -> the planar picture; asked for on another thread.
        borders: numbers of the pictures that parts begin with, and of that after the last.
        size: (width, height).
        rate: frames a second.
        options: of the encoder; a group of pictures may not be shorter than a part.
        regions: coded finer or coarser.

    Raises:
        UserError: if the encoder refuses.
    """
    with TemporaryDirectory(dir=path.parent) as folder:
        single = len(borders) == 2
        files = [path if single else Path(folder) / f"{k}.{codec.container}" for k in range(len(borders) - 1)]
        for file, (first, after) in zip(files, pairwise(borders), strict=True):
            made = in_order((partial(picture, k) for k in range(first, after)), threads=1)
            encode_video(file, made, size, rate, codec, options, regions)
        if not single:
            _join(path, files, rate, codec)


def _join(path: Path, files: Sequence[Path], rate: Fraction, codec: Codec) -> None:
    """One file of the parts' packets, numbered through."""
    with ExitStack() as open_files:
        first = open_files.enter_context(_opened(files[0], codec))
        out = open_files.enter_context(written(path, codec.container))
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
