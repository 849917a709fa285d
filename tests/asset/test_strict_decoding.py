"""Damaged videos with matching checksums: what decoders themselves notice, and files that only claim to be videos."""

from __future__ import annotations

import struct
import time
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from facefolds_core.asset.audio import sound_problem
from facefolds_core.asset.codecs import CODECS, Codec
from facefolds_core.asset.containers import ContainerError, container_of
from facefolds_core.asset.packing import AtlasLayout
from facefolds_core.asset.video import decode_video, encode_video, pack_frame, probe_video, unpack_picture
from facefolds_core.errors import UserError
from facefolds_core.params import VideoCodec
from tests.assets import cap_textures
from tests.hostile.damage import flip_bits

LAYOUT = AtlasLayout.pack([(96, 96)] * 2)
SIZE, FRAMES, TRIED = (LAYOUT.width, LAYOUT.height), 8, 40


def textures(frame: int) -> list[np.ndarray]:
    """Caps with grain: without, most of a video's bytes are headers."""
    grain = np.random.default_rng(0).integers(-12, 13, (2, 96, 96, 4))
    grain[..., 3] = 0
    return list(np.clip(cap_textures(2, frame, 96) + np.roll(grain, 3 * frame, 2), 0, 255).astype(np.uint8))


@pytest.fixture(scope="module", params=sorted(CODECS))
def video(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    codec = CODECS[request.param]
    return encoded(tmp_path_factory.mktemp("strict") / f"{request.param}.{codec.container}", codec, FRAMES, 16)


@pytest.fixture
def mp4(tmp_path: Path) -> Path:
    return encoded(tmp_path / "a.mp4", CODECS["h264"], 2, 30)


def encoded(path: Path, codec: Codec, frames: int, crf: int) -> Path:
    pictures = (pack_frame(textures(k), LAYOUT) for k in range(frames))
    encode_video(path, pictures, SIZE, Fraction(30), codec, codec.options(VideoCodec(), codec.crf(crf)))
    return path


def shown(path: Path) -> np.ndarray:
    """(FRAMES, ...) codes.

    Raises:
        UserError: if the decoder notices the damage, or frames are missing.
    """
    pictures = [unpack_picture(picture, LAYOUT) for picture in decode_video(path, SIZE, 30.0)]
    if len(pictures) != FRAMES:
        raise UserError("frames are missing")
    return np.array(pictures).astype(np.int16)


def test_flipped_bits_are_noticed_by_the_decoder(video: Path, tmp_path: Path) -> None:
    """FFmpeg as it comes shows 39 of 40 with errors of up to 255 codes (H.264 and VP9; AV1: none)."""
    truth, data, wrong = shown(video), video.read_bytes(), 0
    for seed in range(TRIED):
        path = tmp_path / video.name
        path.write_bytes(flip_bits(data, np.random.default_rng(seed)))
        try:
            wrong += bool(np.abs(shown(path) - truth).max() > 2)
        except UserError:
            continue
    assert wrong <= 2  # arithmetic coding: some changes lead to another valid picture


@pytest.mark.parametrize("start", [0, 3])
def test_damage_in_the_middle_is_noticed_from_any_start(video: Path, tmp_path: Path, start: int) -> None:
    data = bytearray(video.read_bytes())
    middle = int(0.4 * len(data))
    data[middle : middle + 64] = bytes(64)
    path = tmp_path / video.name
    path.write_bytes(data)
    with pytest.raises(UserError, match="damaged texture video"):
        list(decode_video(path, SIZE, 30.0, start))


def test_a_playlist_is_not_followed(tmp_path: Path, mp4: Path) -> None:
    path = tmp_path / "full.mp4"
    for text in (f"ffconcat version 1.0\nfile {mp4.name}\n", f"#EXTM3U\n#EXT-X-TARGETDURATION:1\n{mp4.name}\n"):
        path.write_text(text)
        with pytest.raises(UserError, match="neither an MP4 nor a WebM"):
            probe_video(path)
        assert sound_problem(path.rename(tmp_path / "audio.wav"), 1.0)
    (tmp_path / "audio.wav").write_bytes(b"RIFF" + bytes(100))
    assert sound_problem(tmp_path / "audio.wav", 1.0)


def test_matroska_is_not_webm(tmp_path: Path) -> None:
    path = tmp_path / "full.webm"
    with av.open(str(path), "w", format="matroska") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height = SIZE
        container.mux(stream.encode(av.VideoFrame(*SIZE, "yuv420p")))
        container.mux(stream.encode(None))
    with pytest.raises(UserError, match="no WebM"):
        probe_video(path)


@pytest.mark.parametrize("table", [b"stsz", b"stts", b"stsc", b"stco"])
def test_an_mp4_that_claims_a_thousand_million_pictures(mp4: Path, table: bytes) -> None:
    data = bytearray(mp4.read_bytes())
    place = data.index(table) + 4
    if table == b"stsz":
        struct.pack_into(">II", data, place + 4, 1, 10**9)
    elif table == b"stco":
        struct.pack_into(">I", data, place + 4, 10**9)
    else:
        struct.pack_into(">III", data, place + 4, 1, 10**9 if table == b"stts" else 1, 10**9)
    mp4.write_bytes(data)
    start = time.monotonic()
    with pytest.raises(ContainerError, match=table.decode()):
        container_of(mp4)
    with pytest.raises(UserError):
        list(decode_video(mp4, SIZE, 30.0))
    assert time.monotonic() - start < 2


def boxes(count: int) -> bytes:
    """In one another."""
    content = b""
    for _ in range(count):
        content = struct.pack(">I4s", 8 + len(content), b"moov") + content
    return struct.pack(">I4s4s4x", 16, b"ftyp", b"isom") + content


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("a.mp4", b"", "neither"),
        ("a.mp4", b"not a video" * 100, "neither"),
        ("a.mp4", boxes(1), ""),
        ("a.mp4", boxes(2000), "too many boxes"),
        ("a.webm", b"\x1a\x45\xdf\xa3\x87\x42\x82\x84webm\x18\x53\x80\x67\x80", ""),
    ],
    ids=["empty", "text", "no streams", "boxes without end", "no streams of WebM"],
)
def test_what_is_no_video(tmp_path: Path, name: str, content: bytes, word: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match="damaged texture video") as caught:
        probe_video(tmp_path / name)
    assert word in str(caught.value)


def test_quicktime_is_not_mp4(mp4: Path) -> None:
    assert sound_problem(mp4, 1.0) == "it has no audio stream"
    data = bytearray(mp4.read_bytes())
    data[8:12] = b"qt  "
    mp4.write_bytes(data)
    with pytest.raises(UserError, match="QuickTime"):
        probe_video(mp4)
