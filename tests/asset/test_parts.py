"""Videos made of parts: each begins a group of pictures, and only those that changed are encoded."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import parts as module
from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.parts import Filmed, Parts, encode_parts
from facefolds_core.asset.video import Picture, decode_video, encode_video, key_frames, unpack_picture
from facefolds_core.params import VideoCodec
from tests.asset.test_video import LAYOUT, SIZE, number_of, numbered, pack_frame

RATE = Fraction(30000, 1001)
BORDERS = [0, 10, 20, 24]


class Encoded:
    """Videos of numbered pictures; counts the encodings."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.count, self.folder = 0, folder

        def counted(*arguments: object) -> int:
            self.count += 1
            return encode_video(*arguments)  # type: ignore[arg-type]

        monkeypatch.setattr(module, "encode_video", counted)

    def write(self, name: str, kept: str = "kept", codec: str = "h264", changed: int = -1, crf: int = 18) -> Path:
        self.count = 0
        shown = [numbered(63 if k == changed else k) for k in range(BORDERS[-1])]
        filmed = Filmed(lambda k: pack_frame(shown[k], LAYOUT), lambda k: shown[k], SIZE, RATE, "numbers")
        chosen = CODECS[codec]
        options = chosen.options(VideoCodec(codec=codec, preset="medium", keyframe_interval=10), chosen.crf(crf))
        self.parts = Parts(self.folder / kept, b"code")
        path = self.folder / f"{name}.{chosen.container}"
        encode_parts(path, filmed, BORDERS, chosen, options, self.parts)
        return path


@pytest.fixture
def encoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Encoded:
    return Encoded(tmp_path, monkeypatch)


def decoded(path: Path) -> list[Picture]:
    return list(decode_video(path, SIZE, float(RATE)))


@pytest.mark.parametrize("codec", sorted(CODECS))
def test_parts_are_one_video(encoded: Encoded, codec: str) -> None:
    path = encoded.write("a", codec=codec)
    pictures = [unpack_picture(picture, LAYOUT) for picture in decoded(path)]
    assert [number_of(one, 0) for one in pictures] == list(range(24))
    assert key_frames(path) == BORDERS[:-1]
    (last,) = list(decode_video(path, SIZE, float(RATE), 23))
    assert number_of(unpack_picture(last, LAYOUT), 0) == 23


def test_a_changed_part_alone_is_encoded(encoded: Encoded) -> None:
    first = encoded.write("a")
    assert encoded.count == 3
    again = encoded.write("b")
    assert encoded.count == 0
    assert again.read_bytes() == first.read_bytes()
    changed = encoded.write("c", changed=12)
    assert encoded.count == 1
    anew = encoded.write("d", kept="other", changed=12)
    assert encoded.count == 3
    assert changed.read_bytes() == anew.read_bytes() != first.read_bytes()
    before, after = decoded(first), decoded(changed)
    same = [np.array_equal(a, b) for a, b in zip(before, after, strict=True)]
    assert same[:10] == [True] * 10 and same[20:] == [True] * 4 and not same[12]


def test_other_settings_are_other_parts(encoded: Encoded) -> None:
    encoded.write("a")
    encoded.write("b", crf=30)
    assert encoded.count == 3


def test_parts_that_nobody_asked_for_are_removed(encoded: Encoded) -> None:
    encoded.write("a")
    encoded.write("b", changed=12)
    encoded.parts.tidy()
    assert len(list((encoded.folder / "kept").iterdir())) == 3
    encoded.write("c", changed=12)
    assert encoded.count == 0


def filmed(make: Callable[[int], Picture]) -> Filmed:
    """Pictures of which the digest is their number's."""
    return Filmed(make, lambda k: [np.array([k])], SIZE, RATE, "")


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
    encode_parts(tmp_path / "a.mp4", filmed(make), [0, 30], codec, {}, Parts(tmp_path / "b", b""))
    assert made == list(range(30))
    assert max(ahead) == module.PICTURES_AHEAD
