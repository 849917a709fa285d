"""The sequence's sound, as AAC inside an MP4 file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError

from facefolds_core.errors import UserError

AAC_BITS_A_SECOND = 128_000
STRICT = {"err_detect": "crccheck+bitstream+buffer+explode"}
FORMATS = {"format_whitelist": "wav,mov,mp4,m4a,3gp,3g2,mj2,mp3,ogg,flac"}
"""Sound files, none of them able to name another file."""
LONGER = 60.0
"""Seconds that a sound may go on after its sequence; decoding stops there."""


class SoundTrack:
    """An audio stream of a container that is being written.

    Raises:
        UserError: if the file is not sound.
    """

    def __init__(self, container: Any, path: Path) -> None:
        packets = []
        try:
            # Never a guess of FFmpeg's: it knows kinds that open other files.
            with av.open(f"file:{path}", container_options=STRICT | FORMATS) as source:
                if not source.streams.audio:
                    raise _unreadable(path, "it has no audio stream")
                given = source.streams.audio[0]
                layout = "stereo" if given.codec_context.channels > 1 else "mono"
                stream = container.add_stream("aac", rate=given.codec_context.sample_rate, layout=layout)
                stream.codec_context.bit_rate = AAC_BITS_A_SECOND
                convert = av.AudioResampler(format="fltp", layout=layout, rate=given.codec_context.sample_rate)
                for frame in source.decode(given):
                    for part in convert.resample(frame):
                        packets += stream.encode(part)
                for part in convert.resample(None):
                    packets += stream.encode(part)
                packets += stream.encode(None)
        except FFmpegError as error:
            raise _unreadable(path, str(error)) from None
        self._container, self._packets = container, packets

    def mux_until(self, seconds: Fraction) -> None:
        """Write the packets that begin before `seconds`."""
        while self._packets and self._packets[0].pts * self._packets[0].time_base < seconds:
            self._container.mux(self._packets.pop(0))


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
