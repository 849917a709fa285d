"""The sound of a segment, from the capture to the scene."""

from __future__ import annotations

import wave
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.assembly import write_plan
from facefolds_core.captures.sound import cut_sound, sound_start
from facefolds_core.errors import UserError
from facefolds_core.params import FrameRange, NormalizeParams
from tests.captures.fixtures import SEGMENT, plan_of, save_wav, write_multiface

RATE = 6000
FRAMES = tuple(f"{3 * k:06d}" for k in range(6))


def scene_sound(root: Path, frames: FrameRange | tuple[str, ...] | None, samples: np.ndarray) -> tuple[Path, list[str]]:
    """Normalise a capture with a sound; where its sound would lie, and what was left out."""
    write_multiface(root / "capture", FRAMES)
    save_wav(root / "capture" / "audio" / f"{SEGMENT}.wav", samples, RATE)
    plan = plan_of(root / "capture", frames=frames)
    write_plan(plan, NormalizeParams())
    return root / "scene" / "audio.wav", [str(one) for one in plan.scene.left_out]


def heard(path: Path, rate: int = RATE) -> np.ndarray:
    with wave.open(str(path), "rb") as file:
        assert file.getframerate() == rate
        return np.frombuffer(file.readframes(file.getnframes()), "<i2")


def test_sound_begins_with_the_first_frame_in_use(tmp_path: Path) -> None:
    ramp = np.arange(6 * RATE // 30)
    path, _ = scene_sound(tmp_path, FrameRange(start=1, stop=6, step=2), ramp)
    # Frames 1, 3 and 5 at 15 a second: 0.2 seconds from 1/30 on; the sound ends with frame 5's first half.
    expected = np.concatenate([ramp[RATE // 30 :], np.zeros(RATE // 5, int)])[: RATE // 5]
    np.testing.assert_array_equal(heard(path), expected)


@pytest.mark.parametrize("start", range(6))
def test_a_cut_that_falls_between_samples_has_its_length(tmp_path: Path, start: int) -> None:
    save_wav(tmp_path / "sound.wav", np.arange(16_000), 16_000)
    cut_sound(tmp_path / "sound.wav", tmp_path / "cut.wav", start / 30, 4 / 30)
    first = round(start * 16_000 / 30)
    np.testing.assert_array_equal(heard(tmp_path / "cut.wav", 16_000), np.arange(first, first + round(4 * 16_000 / 30)))


def test_frames_that_are_not_evenly_spaced_have_no_sound(tmp_path: Path) -> None:
    path, left_out = scene_sound(tmp_path, (FRAMES[0], FRAMES[1], FRAMES[4]), np.zeros(RATE))
    assert not path.exists() and "evenly spaced" in str(left_out)


def test_a_single_frame_has_its_place() -> None:
    assert sound_start([0.4], 0.0) == 0.4


def test_a_damaged_sound_is_named(tmp_path: Path) -> None:
    write_multiface(tmp_path / "capture", FRAMES)
    path = tmp_path / "capture" / "audio" / f"{SEGMENT}.wav"
    path.parent.mkdir()
    path.write_bytes(b"no sound" * 50)
    with pytest.raises(UserError, match="sound cannot be read"):
        write_plan(plan_of(tmp_path / "capture"), NormalizeParams())
