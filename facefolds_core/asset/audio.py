"""The sequence's sound, as AAC inside an MP4 file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError

from facefolds_core.errors import UserError

AAC_BITS_A_SECOND = 128_000


class SoundTrack:
    """An audio stream of a container that is being written.

    Raises:
        UserError: if the file is not sound.
    """

    def __init__(self, container: Any, path: Path) -> None:
        packets = []
        try:
            with av.open(str(path)) as source:
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


def _unreadable(path: Path, found: str) -> UserError:
    return UserError("the sound cannot be read", file=path, found=found, remedy="replace the file, or remove it")
