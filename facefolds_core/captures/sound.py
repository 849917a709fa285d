"""The sound of a capture, cut to the frames that are used."""

from __future__ import annotations

import wave
from collections.abc import Sequence
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError

from facefolds_core.errors import UserError

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
    """Write `seconds` of a sound file from `start` on as WAV, 16 bits; what lies beyond its end is silent.

    Raises:
        UserError: if the file is not sound.
    """
    try:
        with av.open(str(source)) as container:
            if not container.streams.audio:
                raise _unreadable(source, "it has no audio stream")
            stream = container.streams.audio[0]
            rate, layout = stream.codec_context.sample_rate, stream.codec_context.channels > 1
            convert = av.AudioResampler(format="s16", layout="stereo" if layout else "mono", rate=rate)
            frames = [part for frame in container.decode(stream) for part in convert.resample(frame)]
            frames += convert.resample(None)
    except FFmpegError as error:
        raise _unreadable(source, str(error)) from None
    channels = 2 if layout else 1
    samples = np.concatenate([np.zeros(0, np.int16), *(frame.to_ndarray().reshape(-1) for frame in frames)])
    first, length = round(start * rate), round(seconds * rate)
    samples = samples.reshape(-1, channels)[first : first + length]
    silence = np.zeros((length - len(samples), channels), np.int16)
    with wave.open(str(target), "wb") as file:
        file.setparams((channels, 2, rate, 0, "NONE", ""))
        file.writeframes(np.concatenate([samples, silence]).astype("<i2").tobytes())


def _unreadable(path: Path, found: str) -> UserError:
    return UserError("the sound cannot be read", file=path, found=found, remedy="replace the file, or remove it")
