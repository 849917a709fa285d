"""The sequence's sound, as AAC in an MP4 file of its own, and under films that show the sequence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.error import FFmpegError
from numpy.typing import NDArray

from facefolds_core.asset.video import CHECKED, NO_ROOM, written
from facefolds_core.errors import UserError

AAC_BITS_A_SECOND = 128_000
AAC_FRAME = 1024
"""Samples that the encoder takes at once."""
AAC_MIME = 'audio/mp4; codecs="mp4a.40.2"'
FORMATS = {"format_whitelist": "wav,mov,mp4,m4a,3gp,3g2,mj2,mp3,ogg,flac"}
"""Sound files, none of them able to name another file."""
FILM_RATE = 48_000
"""Samples a second of a film's sound: AAC knows no rate above 96 000."""
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
            av.open(f"file:{source}", container_options=CHECKED | FORMATS) as given,
            written(path, "mp4") as made,
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
        if error.errno in NO_ROOM:
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


def write_film_with_sound(path: Path, film: Path, source: Path, sequence: Fraction, first: Fraction) -> None:
    """`film`, a video in MP4 as it is, with the sound of the sequence that it shows, again and again.

    Args:
        source: the sound, as `encode_sound` writes it.
        sequence: seconds of the sequence: what the sound has beyond them is not heard; after its own end it is still.
        first: seconds of the sequence at which the film begins.

    Raises:
        UserError: if the sound cannot be read.
    """
    once, layout, rate = *_heard_once(source, sequence), FILM_RATE
    with av.open(str(film)) as shown, written(path, "mp4") as made:
        pictures: Any = shown.streams.video[0]
        sound: Any = made.add_stream("aac", rate=rate, layout=layout)
        sound.codec_context.bit_rate = AAC_BITS_A_SECOND
        copied = made.add_stream_from_template(pictures)
        packet: Any
        samples, end = 0, 0
        for packet in shown.demux(pictures):
            if packet.dts is None:  # the flush at the end
                continue
            end = max(end, packet.pts + packet.duration)
            packet.stream = copied
            made.mux(packet)
            while samples < end * pictures.time_base * rate:
                made.mux(sound.encode(_part(once, samples, round(first * rate), rate, layout)))
                samples += AAC_FRAME
        made.mux(sound.encode(None))


def _heard_once(source: Path, sequence: Fraction) -> tuple[NDArray[np.float32], str]:
    """(channels, samples) of one sequence, still after the sound's end, and their layout."""
    samples = round(sequence * FILM_RATE)
    try:
        with av.open(f"file:{source}", container_options=CHECKED | FORMATS) as given:
            if not given.streams.audio:
                raise _unreadable(source, "it has no audio stream")
            stream = given.streams.audio[0]
            layout = "stereo" if stream.codec_context.channels > 1 else "mono"
            parts = [part.to_ndarray() for part in _within(given.decode(stream), samples, FILM_RATE, layout)]
    except FFmpegError as error:
        raise _unreadable(source, str(error)) from None
    heard = np.concatenate([*parts, np.zeros((2 if layout == "stereo" else 1, samples), np.float32)], 1)
    return heard[:, :samples], layout


def _part(once: NDArray[np.float32], start: int, first: int, rate: int, layout: str) -> av.AudioFrame:
    """The film's samples from `start` on, as many as the encoder takes at once."""
    wanted = np.arange(first + start, first + start + AAC_FRAME) % once.shape[1]
    frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(once[:, wanted]), format="fltp", layout=layout)
    frame.sample_rate, frame.pts, frame.time_base = rate, start, Fraction(1, rate)
    return frame


def sound_problem(path: Path, seconds: float) -> str | None:
    """What is wrong with a sound file of a sequence of `seconds`, in words; None if it decodes whole, strictly."""
    try:
        with av.open(f"file:{path}", container_options=CHECKED | FORMATS) as source:
            if not source.streams.audio:
                return "it has no audio stream"
            stream = source.streams.audio[0]
            stream.codec_context.options = CHECKED
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
