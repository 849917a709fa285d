"""The sequence's sound as a file of its own."""

from __future__ import annotations

import wave
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from facefolds_core.asset.audio import encode_sound, sound_problem, write_film_with_sound
from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.video import encode_video
from facefolds_core.errors import UserError


def tone(path: Path, seconds: float, channels: int = 1) -> Path:
    """440 Hz."""
    with wave.open(str(path), "wb") as file:
        file.setparams((channels, 2, 48_000, 0, "NONE", ""))
        wave_form = 8000 * np.sin(2 * np.pi * 440 * np.arange(round(48_000 * seconds)) / 48_000)
        file.writeframes(np.repeat(wave_form.astype("<i2"), channels).tobytes())
    return path


@pytest.mark.parametrize("channels", [1, 2])
def test_it_is_the_sound_and_no_longer_than_the_pictures(tmp_path: Path, channels: int) -> None:
    made = tmp_path / "audio.m4a"
    assert encode_sound(made, tone(tmp_path / "tone.wav", 2.0, channels), 20 / 30) == 'audio/mp4; codecs="mp4a.40.2"'
    with av.open(str(made)) as container:
        assert (len(container.streams), container.streams.audio[0].codec_context.channels) == (1, channels)
        heard = np.concatenate([frame.to_ndarray()[0] for frame in container.decode(audio=0)])
    spectrum = np.abs(np.fft.rfft(heard))
    assert abs(spectrum.argmax() * 48_000 / len(heard) - 440) < 3
    assert len(heard) / 48_000 == pytest.approx(20 / 30, abs=0.03)
    assert sound_problem(made, 20 / 30) is None


@pytest.mark.parametrize("channels", [1, 2])
def test_a_films_sound_goes_with_its_pictures(tmp_path: Path, channels: int) -> None:
    """A sequence of half a second, heard in its first half; the film begins in the middle and shows it three times."""
    sound, film, made = tmp_path / "audio.m4a", tmp_path / "silent.mp4", tmp_path / "film.mp4"
    encode_sound(sound, tone(tmp_path / "tone.wav", 0.25, channels), 0.5)
    pictures = [np.full((24, 16), 60 + 10 * i, np.uint8) for i in range(15)]
    encode_video(film, pictures, (16, 16), Fraction(10), CODECS["h264"], {"crf": "20"})
    write_film_with_sound(made, film, sound, Fraction(1, 2), Fraction(1, 4))
    with av.open(str(made)) as container:
        shown = [frame.to_ndarray() for frame in container.decode(video=0)]
    with av.open(str(film)) as container:
        assert all((a == frame.to_ndarray()).all() for a, frame in zip(shown, container.decode(video=0), strict=True))
    with av.open(str(made)) as container:
        heard = np.concatenate([frame.to_ndarray() for frame in container.decode(audio=0)], 1)
    assert len(heard) == channels and heard.shape[1] / 48_000 == pytest.approx(1.5, abs=0.05)
    loud = [float(np.abs(heard[0, round(t * 48_000) :][:4800]).max()) for t in np.arange(6) * 0.25 + 0.07]
    assert [value > 0.1 for value in loud] == [False, True] * 3


@pytest.mark.parametrize("content", [b"no sound", b""])
def test_a_film_of_a_sound_that_cannot_be_read_names_it(tmp_path: Path, content: bytes) -> None:
    sound, film = tmp_path / "audio.m4a", tmp_path / "silent.mp4"
    sound.write_bytes(content)
    encode_video(film, [np.full((24, 16), 60, np.uint8)], (16, 16), Fraction(10), CODECS["h264"], {"crf": "20"})
    with pytest.raises(UserError, match="sound cannot be read"):
        write_film_with_sound(tmp_path / "film.mp4", film, sound, Fraction(1, 2), Fraction(0))
    with pytest.raises(UserError, match="no audio stream"):
        write_film_with_sound(tmp_path / "film.mp4", film, film, Fraction(1, 2), Fraction(0))


def test_the_same_bytes_each_time(tmp_path: Path) -> None:
    source = tone(tmp_path / "tone.wav", 0.3)
    for name in ("a.m4a", "b.m4a"):
        encode_sound(tmp_path / name, source, 0.3)
    assert (tmp_path / "a.m4a").read_bytes() == (tmp_path / "b.m4a").read_bytes()


def test_what_is_no_sound_is_named(tmp_path: Path) -> None:
    (tmp_path / "x.wav").write_bytes(b"#EXTM3U\n/etc/passwd\n")
    with pytest.raises(UserError, match="sound cannot be read"):
        encode_sound(tmp_path / "a.m4a", tmp_path / "x.wav", 1.0)
