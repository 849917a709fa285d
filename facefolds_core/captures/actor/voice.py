"""What the actor says, to be heard: espeak-ng's voice, where it is installed, each phrase while the mouth says it."""

from __future__ import annotations

import io
import shutil
import subprocess
import wave
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.motion import PERIOD
from facefolds_core.captures.actor.speech import PHRASES

PROGRAM = "espeak-ng"
VOICE = "en-us+f3"
WORDS_A_MINUTE, SLOWEST, FASTEST = 160, 80, 400
"""Of the first try; what the program takes."""
SILENT = 0.01
"""Of the loudest sample: what is fainter before and after a phrase is cut off."""

Samples = NDArray[np.int16]


def speak(path: Path, seconds: float) -> bool:
    """Write the sound of the take's first `seconds`, as WAV; False, and nothing is written, without espeak-ng."""
    if shutil.which(PROGRAM) is None:
        return False
    rate = phrase(PHRASES[0][0], WORDS_A_MINUTE)[1]
    take = np.zeros(round(PERIOD * rate), np.int16)
    for words, begin, end in PHRASES:
        said = fitted(words, end - begin)
        start = round(begin * rate)
        take[start : start + len(said)] = said
    path.parent.mkdir(parents=True, exist_ok=True)
    with wave.open(str(path), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(take.itemsize)
        out.setframerate(rate)
        out.writeframes(np.resize(take, round(seconds * rate)).tobytes())
    return True


def fitted(words: str, seconds: float) -> Samples:
    """A phrase at the speed at which it takes that long, or a little less."""
    said, rate = phrase(words, WORDS_A_MINUTE)
    speed = round(WORDS_A_MINUTE * len(said) / rate / seconds)
    return phrase(words, min(max(speed, SLOWEST), FASTEST))[0][: round(seconds * rate)]


def phrase(words: str, speed: int) -> tuple[Samples, int]:
    """What espeak-ng says, without the silence around it, and samples a second."""
    command = [PROGRAM, "-v", VOICE, "-s", str(speed), "--stdout", words]
    with wave.open(io.BytesIO(subprocess.run(command, check=True, capture_output=True).stdout)) as sound:
        rate, data = sound.getframerate(), sound.readframes(sound.getnframes())
    samples = np.frombuffer(data[: len(data) // 2 * 2], "<i2")
    loud = np.flatnonzero(np.abs(samples.astype(int)) > SILENT * np.abs(samples.astype(int)).max())
    return samples[loud[0] : loud[-1] + 1], rate
