"""Her voice: each phrase while the mouth says it, at the speed that fits; nothing without espeak-ng."""

from __future__ import annotations

import shutil
import sys
import wave
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.actor.capture import PROGRAM, speak
from facefolds_core.captures.actor.speech import PHRASES

RATE = 8000
SPEAKER = f"""#!{sys.executable}
import sys, wave
speed = int(sys.argv[sys.argv.index("-s") + 1])
with wave.open(sys.stdout.buffer, "wb") as out:  # as long as words take at that speed, with silence around
    out.setparams((1, 2, {RATE}, 0, "NONE", ""))
    loud = b"\\x00\\x40" * int({RATE} * 160 / speed)
    out.writeframes(bytes(800) + loud + bytes(800))
"""


def heard(path: Path) -> tuple[np.ndarray, int]:
    """Loudness of each hundredth of a second, and how many there are."""
    with wave.open(str(path)) as sound:
        rate = sound.getframerate()
        samples = np.frombuffer(sound.readframes(sound.getnframes()), "<i2").astype(float)
    step = rate // 100
    parts = samples[: len(samples) // step * step].reshape(-1, step)
    return np.abs(parts).max(1), len(parts)


def said_at(time: float) -> bool:
    return any(begin <= time % 4 <= end for _, begin, end in PHRASES)


def check(path: Path, seconds: float) -> None:
    loudness, count = heard(path)
    assert count == pytest.approx(100 * seconds, abs=1)
    silent = [value for k, value in enumerate(loudness) if not (said_at(k / 100) or said_at((k + 1) / 100))]
    assert max(silent) < 0.02 * loudness.max()
    for _, begin, end in PHRASES:
        if end < seconds:
            assert loudness[round(100 * begin) : round(100 * begin) + 10].max() > 0.1 * loudness.max()
            assert loudness[round(100 * end) - 25 : round(100 * end)].max() > 0.02 * loudness.max()


@pytest.mark.parametrize("seconds", [1.5, 4.0, 9.0])
def test_phrases_are_fitted_to_the_mouth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    (tmp_path / PROGRAM).write_text(SPEAKER)
    (tmp_path / PROGRAM).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert speak(tmp_path / "audio" / "voice.wav", seconds)
    check(tmp_path / "audio" / "voice.wav", seconds)


@pytest.mark.skipif(shutil.which(PROGRAM) is None, reason="no espeak-ng: apt-get install espeak-ng")
def test_espeak_says_them(tmp_path: Path) -> None:
    assert speak(tmp_path / "voice.wav", 4.0)
    check(tmp_path / "voice.wav", 4.0)


def test_without_it_she_is_silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert not speak(tmp_path / "voice.wav", 4.0)
    assert not list(tmp_path.iterdir())
