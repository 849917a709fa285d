"""Videos made of parts: each begins a group of pictures."""

from __future__ import annotations

import time
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import pytest

from facefolds_core.asset import parts as module
from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.parts import encode_parts
from facefolds_core.asset.video import Picture, decode_video, key_frames, unpack_picture
from facefolds_core.params import VideoCodec
from tests.asset.test_video import LAYOUT, SIZE, number_of, numbered, pack_frame

RATE = Fraction(30000, 1001)
BORDERS = [0, 10, 20, 24]


def write(folder: Path, codec: str) -> Path:
    """A video of numbered pictures."""
    chosen = CODECS[codec]
    options = chosen.options(VideoCodec(codec=codec, preset="medium", keyframe_interval=10), chosen.crf(18))
    path = folder / f"a.{chosen.container}"
    encode_parts(path, lambda k: pack_frame(numbered(k), LAYOUT), BORDERS, SIZE, RATE, chosen, options)
    return path


def decoded(path: Path) -> list[Picture]:
    return list(decode_video(path, SIZE, float(RATE)))


@pytest.mark.parametrize("codec", sorted(CODECS))
def test_parts_are_one_video(tmp_path: Path, codec: str) -> None:
    path = write(tmp_path, codec)
    pictures = [unpack_picture(picture, LAYOUT) for picture in decoded(path)]
    assert [number_of(one, 0) for one in pictures] == list(range(24))
    assert key_frames(path) == BORDERS[:-1]
    (last,) = list(decode_video(path, SIZE, float(RATE), 23))
    assert number_of(unpack_picture(last, LAYOUT), 0) == 23


def test_few_pictures_are_made_ahead(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, ahead = list[int](), list[int]()
    picture = pack_frame(numbered(1), LAYOUT)

    def make(k: int) -> Picture:
        made.append(k)
        return picture

    def looking(path: Path, pictures: Iterable[Picture], *rest: object) -> int:
        for count, _ in enumerate(pictures, 1):
            time.sleep(0.005)  # a thread that did not wait would make all
            ahead.append(len(made) - count)
        path.touch()
        return count

    monkeypatch.setattr(module, "encode_video", looking)
    codec = CODECS["h264"]
    encode_parts(tmp_path / "a.mp4", make, [0, 30], SIZE, RATE, codec, {})
    assert made == list(range(30))
    assert max(ahead) == 2
