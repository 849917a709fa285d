"""The video of a file with the extension and its sound in one: every reader plays them in step."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from heapq import merge
from pathlib import Path
from typing import Any

import av

from facefolds_core.asset.audio import AAC_MIME, encode_sound


def with_sound(video: Path, sound: Path, mime: str | None, seconds: float) -> bytes:
    """An MP4 with the pictures as they are and the first `seconds` of a sound.

    Args:
        mime: of the sound, where it is known: AAC stays as it is, too.

    Raises:
        UserError: if the sound cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder:
        encoded, joined = (Path(folder) / name for name in ("sound.mp4", "joined.mp4"))
        if mime != AAC_MIME:
            encode_sound(encoded, sound, seconds)
        _join(joined, video, sound if mime == AAC_MIME else encoded)
        return joined.read_bytes()


def mime_with_sound(mime: str) -> str:
    """Of the video's type, e.g. `video/mp4; codecs="avc1.64000a"`, that of both."""
    codec, sound = (text.partition('codecs="')[2].rstrip('"') for text in (mime, AAC_MIME))
    return f'video/mp4; codecs="{codec}, {sound}"'


def _join(path: Path, video: Path, sound: Path) -> None:
    options = {"fflags": "bitexact", "movflags": "faststart"}
    with (
        av.open(f"file:{video}") as pictures,
        av.open(f"file:{sound}") as heard,
        av.open(str(path), "w", format="mp4", options=options) as made,
    ):
        tracks = [_packets(pictures, pictures.streams.video[0], made), _packets(heard, heard.streams.audio[0], made)]
        for packet in merge(*tracks, key=lambda packet: packet.dts * packet.time_base):
            made.mux(packet)


def _packets(source: Any, stream: Any, made: Any) -> Iterator[Any]:
    """Of a stream, for its copy in the file that is made."""
    copy = made.add_stream_from_template(stream)

    def moved() -> Iterator[Any]:
        for packet in source.demux(stream):
            if packet.dts is not None:  # the last one is empty
                packet.stream = copy
                yield packet

    return moved()
