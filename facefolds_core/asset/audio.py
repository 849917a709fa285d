"""The sequence's sound, as AAC in an MP4 file of its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError

from facefolds_core.errors import UserError

AAC_BITS_A_SECOND = 128_000
AAC_FRAME = 1024
"""Samples that the encoder takes at once."""
AAC_MIME = 'audio/mp4; codecs="mp4a.40.2"'
STRICT = {"err_detect": "crccheck+bitstream+buffer+explode"}
FORMATS = {"format_whitelist": "wav,mov,mp4,m4a,3gp,3g2,mj2,mp3,ogg,flac"}
"""Sound files, none of them able to name another file."""
LONGER = 60.0
"""Seconds that a sound may go on after its sequence; decoding stops there."""


def encode_sound(path: Path, source: Path, seconds: float) -> str:
    """Write the first `seconds` of a sound file as AAC in MP4, a track of its own; returns its MIME type.

    Raises:
        UserError: if the file is not sound.
    """
    try:
        # Never a guess of FFmpeg's: it knows kinds that open other files.
        with (
            av.open(f"file:{source}", container_options=STRICT | FORMATS) as given,
            av.open(str(path), "w", format="mp4", options={"fflags": "bitexact", "movflags": "faststart"}) as made,
        ):
            if not given.streams.audio:
                raise _unreadable(source, "it has no audio stream")
            stream = given.streams.audio[0]
            rate, layout = stream.codec_context.sample_rate, "stereo" if stream.codec_context.channels > 1 else "mono"
            sound: Any = made.add_stream("aac", rate=rate, layout=layout)
            sound.codec_context.bit_rate = AAC_BITS_A_SECOND
            for frame in _within(given.decode(stream), round(seconds * rate), rate, layout):
                made.mux(sound.encode(frame))
            made.mux(sound.encode(None))
    except FFmpegError as error:
        if error.errno in (28, 122):  # disk full, quota: reported as such by the stage
            raise
        raise _unreadable(source, str(error)) from None
    return AAC_MIME


def _within(frames: Iterable[Any], samples: int, rate: int, layout: str) -> Iterator[Any]:
    """The first `samples` (whole frames) as AAC's encoder takes them."""
    convert, count = av.AudioResampler(format="fltp", layout=layout, rate=rate, frame_size=AAC_FRAME), 0
    for frame in chain(frames, [None]):
        for part in convert.resample(frame):
            if count < samples:
                yield part
            count += part.samples


def sound_problem(path: Path, seconds: float) -> str | None:
    """What is wrong with a sound file of a sequence of `seconds`, in words; None if it decodes whole, strictly."""
    try:
        with av.open(f"file:{path}", container_options=STRICT | FORMATS) as source:
            if not source.streams.audio:
                return "it has no audio stream"
            stream = source.streams.audio[0]
            stream.codec_context.options = STRICT
            samples = 0
            for frame in source.decode(stream):
                samples += frame.samples
                if frame.is_corrupt:
                    return f"its sound is damaged after {samples / frame.sample_rate:.1f} seconds"
                if samples > (seconds + LONGER) * frame.sample_rate:
                    return f"it is longer than its sequence of {seconds:.1f} seconds by more than {LONGER:.0f}"
            return None if samples else "it has no sound"
    except (FFmpegError, UnicodeDecodeError, ValueError, ZeroDivisionError) as error:
        return f"not a sound: {error}"


def _unreadable(path: Path, found: str) -> UserError:
    return UserError("the sound cannot be read", file=path, found=found, remedy="replace the file, or remove it")
