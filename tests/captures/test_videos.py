"""Videos of a capture: read once, in order; what would put other moments side by side is refused."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from av.video.reformatter import ColorRange, Colorspace, Interpolation

from facefolds_core.captures import videos
from facefolds_core.captures.capture import Capture, View
from facefolds_core.captures.developing import Negative, photos
from facefolds_core.captures.picture import VideoFrame
from facefolds_core.captures.videos import CameraVideo, check_together
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import NormalizeParams
from tests.filmed import save_video

FRAMES = np.random.default_rng(0).integers(0, 256, (12, 16, 24, 3), dtype=np.uint8)
"""Of 24 x 16 pixels."""


def write(path: Path, frames: np.ndarray = FRAMES, rate: int = 25, **options: Any) -> Path:
    save_video(path, frames, rate, **options)
    return path


def video(path: Path) -> CameraVideo:
    return CameraVideo(path, "c7")


def refused(path: Path, match: str) -> UserError:
    """What is said of a video by its index alone."""
    with pytest.raises(UserError, match=match) as caught:
        video(path).facts()
    assert caught.value.file == path and "camera c7" in str(caught.value.place)
    return caught.value


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".mov"])
def test_facts_are_those_of_the_index(tmp_path: Path, suffix: str) -> None:
    facts = video(write(tmp_path / f"a{suffix}")).facts()
    assert (facts.size, facts.count, facts.rate, facts.start) == ((24, 16), 12, 25, 0.0)


@pytest.mark.parametrize("threads", [1, 4])
def test_frames_come_in_order_and_equal(tmp_path: Path, threads: int) -> None:
    wanted = [0, 3, 4, 11]
    found = list(video(write(tmp_path / "a.mp4")).frames(wanted, "rgb", threads))
    np.testing.assert_array_equal(found, FRAMES[wanted])


def test_one_run_opens_the_video_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = video(write(tmp_path / "a.mp4"))
    source.facts()
    opened: list[object] = []
    real = av.open
    monkeypatch.setattr(videos.av, "open", lambda *a, **k: opened.append(a) or real(*a, **k))
    camera = Camera("c7", np.array([[20.0, 0, 12], [0, 20, 8], [0, 0, 1]]), np.eye(4)[:3], 24, 16)
    capture = Capture(tmp_path, (View(camera),), tuple("abcdefghijkl"), 25.0, {}, {}, None, ())
    negatives = [Negative((0, k), 0, VideoFrame(source, k), "") for k in range(12)]
    found = list(photos(capture, negatives, 24, 16, NormalizeParams()))
    assert [row[:2] for row in found] == [(0, k) for k in range(12)] and len(opened) == 1
    np.testing.assert_array_equal([row[2] for row in found], FRAMES)


def test_opacity_is_one_channel(tmp_path: Path) -> None:
    grey = np.repeat(FRAMES[..., :1], 3, -1)
    (found,) = video(write(tmp_path / "a.mp4", grey)).frames([2], "opacity")
    np.testing.assert_array_equal(found, grey[2, ..., :1])


def test_limited_range_is_expanded(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": "0"})
        stream.width, stream.height, stream.pix_fmt = 24, 16, "yuv420p"
        planes = np.concatenate([np.full((16, 24), 235, np.uint8), np.full((8, 24), 128, np.uint8)])
        container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, "yuv420p")))
        container.mux(stream.encode())
    (found,) = video(path).frames([0], "opacity")
    assert found.min() >= 254


def smooth_rgb() -> np.ndarray:
    """(80, 96, 3): all hues, slowly."""
    y, x = np.mgrid[0:80, 0:96] / 96
    waves = [np.sin(5 * x), np.sin(4 * y + 1), np.sin(3 * (x + y) + 2)]
    return np.round(127.5 + 100 * np.stack(waves, -1)).astype(np.uint8)


@pytest.mark.parametrize("matrix", [None, Colorspace.ITU601, Colorspace.ITU709])
@pytest.mark.parametrize("full", [False, True])
def test_colours_of_lossy_video_come_back(tmp_path: Path, matrix: Colorspace | None, full: bool) -> None:
    path, rgb = tmp_path / "a.mp4", smooth_rgb()
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": "2"})
        stream.width, stream.height, stream.pix_fmt = 96, 80, "yuv420p"
        context = stream.codec_context
        if matrix is not None:
            context.colorspace = matrix
        context.color_range = ColorRange.JPEG if full else ColorRange.MPEG
        for _ in range(3):
            frame = av.VideoFrame.from_ndarray(rgb, "rgb24").reformat(
                format="yuv420p",
                dst_colorspace=matrix or Colorspace.ITU601,
                dst_color_range=ColorRange.JPEG if full else ColorRange.MPEG,
                interpolation=Interpolation.AREA | Interpolation.ACCURATE_RND,
            )
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    for found in video(path).frames([0, 2], "rgb"):
        error = np.mean((found.astype(float) - rgb) ** 2)
        assert 10 * np.log10(255**2 / error) > 44  # 4:2:0 costs the rest; another matrix or range: 30 and less


@pytest.mark.parametrize(
    ("container", "match", "found"),
    [({}, "cannot read a video", "cut off, or no video"), ({"movflags": "faststart"}, "a video is cut off", "")],
    ids=["its index, too", "behind its index"],
)
def test_a_video_that_is_cut_off(tmp_path: Path, container: dict[str, str], match: str, found: str) -> None:
    path = write(tmp_path / "a.mp4", container=container)
    path.write_bytes(path.read_bytes()[:-3000])
    assert found in str(refused(path, match).found)


@pytest.mark.parametrize(
    ("name", "content", "match"),
    [
        ("a.mp4", b"", "cannot read a video"),
        ("a.mp4", b"no video at all" * 100, "cannot read a video"),
        ("a.mp4", None, "a video is missing"),
        ("a.gif", b"GIF89a", "a video of a kind that is not read"),
    ],
)
def test_what_is_no_video(tmp_path: Path, name: str, content: bytes | None, match: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, match)


def test_damage_within_names_the_frame(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mp4")
    data = bytearray(path.read_bytes())
    middle = (data.index(b"mdat") + data.index(b"moov")) // 2
    data[middle : middle + 600] = b"\xff" * 600
    path.write_bytes(data)
    with pytest.raises(UserError, match="a damaged video") as caught:
        list(video(path).frames(range(12), "rgb"))
    assert "camera c7, frame" in str(caught.value.place)


def test_a_variable_rate_names_the_gap(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mp4", times=[0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12])
    assert str(refused(path, "variable frame rate").place) == "camera c7, frame 4"


def test_a_tag_that_turns_it(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mp4")
    data = bytearray(path.read_bytes())
    matrix = data.index(b"tkhd") + 4 + 40
    data[matrix : matrix + 36] = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, 16 << 16, 0, 1 << 30)
    path.write_bytes(data)
    assert "90" in str(refused(path, "turns it").found)


def several(folder: Path, *made: dict[str, Any]) -> list[CameraVideo]:
    return [CameraVideo(write(folder / f"{c}.mp4", **keys), f"c{c}") for c, keys in enumerate(made)]


def test_videos_that_run_side_by_side(tmp_path: Path) -> None:
    """Frames that all have may be used."""
    assert check_together(several(tmp_path, {}, {}, {})) == (12, 25)
    assert check_together(several(tmp_path, {}, {"frames": FRAMES[:10]}, {}), most=8) == (10, 25)


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        ({"frames": FRAMES[:10]}, "videos of different lengths"),
        ({"rate": 30}, "videos of different frame rates"),
        ({"times": range(3, 15)}, "a camera with a time offset"),
    ],
)
def test_one_that_does_not_is_named(tmp_path: Path, odd: dict[str, Any], words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        check_together(several(tmp_path, {}, odd, {}))
    assert "camera c1" in str(caught.value.place)
