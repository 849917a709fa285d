"""The sound of a capture, cut to the frames that are used."""

from __future__ import annotations

import wave
from collections.abc import Sequence
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError

from facefolds_core.errors import UserError
from facefolds_core.files.reading import LARGEST, check_regular, no_memory

_REMEDY = "replace the file, or remove it"
RATES = (1000, 384_000)
"""Samples a second."""
LATE = 1e-3
"""Seconds by which a picture may be off its sound."""


def sound_start(seconds: Sequence[float], fps: float) -> float | None:
    """Where in the sound frame 0 lies, if frame k lies k / fps later: None if the frames are not so spaced.

    Args:
        seconds: of each frame in the sound.
        fps: frames a second of the scene; 0 for a single frame.
    """
    expected = seconds[0] + np.arange(len(seconds)) / (fps or 1.0)
    return None if np.abs(expected - seconds).max() > LATE else seconds[0]


def cut_sound(source: Path, target: Path, start: float, seconds: float) -> None:
    """Write `seconds` of a sound file from `start` on as WAV, 16 bits; what lies beyond its end is silent."""
    _check_length(source)
    try:
        with av.open(str(source), format="wav") as container:  # any other would let FFmpeg guess: playlists, addresses
            if not container.streams.audio:
                raise _unreadable(source, "it has no audio stream")
            stream = container.streams.audio[0]
            rate, channels = stream.codec_context.sample_rate, 2 if stream.codec_context.channels > 1 else 1
            if not RATES[0] <= rate <= RATES[1]:
                raise _unreadable(source, f"{rate} samples a second")
            convert = av.AudioResampler(format="s16", layout="stereo" if channels == 2 else "mono", rate=rate)
            frames = [part for frame in container.decode(stream) for part in convert.resample(frame)]
            frames += convert.resample(None)
    except (FFmpegError, ValueError, OverflowError) as error:
        raise _unreadable(source, str(error)) from None
    except MemoryError:
        raise no_memory(source) from None
    samples = np.concatenate([np.zeros(0, np.int16), *(frame.to_ndarray().reshape(-1) for frame in frames)])
    first, length = round(start * rate), round(seconds * rate)
    samples = samples.reshape(-1, channels)[first : first + length]
    silence = np.zeros((length - len(samples), channels), np.int16)
    with wave.open(str(target), "wb") as file:
        file.setparams((channels, 2, rate, 0, "NONE", ""))
        file.writeframes(np.concatenate([samples, silence]).astype("<i2").tobytes())


def _check_length(path: Path) -> None:
    """Refuse what is no regular WAV file, and one that is shorter than its own header says."""
    size = check_regular(path, _REMEDY, largest=LARGEST)
    with path.open("rb") as file:
        head = file.read(12)
    if head[:4] != b"RIFF" or head[8:] != b"WAVE":
        raise _unreadable(path, f"{size} bytes that are no WAV file")
    said = int.from_bytes(head[4:8], "little")
    if said not in (0, 0xFFFFFFFF) and said + 8 > size + 1:  # both: written to a pipe, length unknown
        raise _unreadable(path, f"{size} bytes of the {said + 8} that its header says")


def _unreadable(path: Path, found: str) -> UserError:
    return UserError("the sound cannot be read", file=path, found=found, remedy=_REMEDY)
