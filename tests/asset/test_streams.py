"""Long takes in segments: what is written, and that it is read, checked and refused by segments."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.manifest_file import parse_manifest
from facefolds_core.asset.packing import AtlasLayout
from facefolds_core.asset.validation import validate_asset
from facefolds_core.errors import UserError
from tests.assets import make_asset
from tests.hostile.fuzz_assets import edit
from tests.streamed import streamed_asset

SECTION = {
    "video": {"codec": ["h264", "vp9", "av1"], "crf": 20},
    "stream": {"beyond": 0, "segment_seconds": 0.2},
    "levels": [{"name": "small", "mesh_resolution": 8, "texture_resolution": 32, "crf": 26}],
}
FRAMES = 14
NAMES = {"manifest.json", "full_meshes.bin", "audio.mp4", "audio.m3u8", "stream.mpd", "stream.m3u8"}
TRACKS = [f"{level}{codec}" for level in ("small", "full") for codec in ("", "_vp9", "_av1")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stream") / "asset"
    streamed_asset(folder, SECTION, FRAMES, sound=True)
    return folder


@pytest.fixture
def asset(whole: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    return Path(shutil.copytree(whole, tmp_path / "asset"))


def test_it_is_sound_and_has_nothing_else(whole: Path) -> None:
    assert validate_asset(whole) == []
    tracks = {f"{track}.{suffix}" for track in TRACKS for suffix in ("mp4", "m3u8")}
    assert {path.name for path in whole.iterdir()} == NAMES | tracks


def test_segments_are_groups_of_pictures_that_lie_end_to_end(whole: Path) -> None:
    for level in parse_manifest(whole / "manifest.json").levels:
        assert level.texture.keyframes == (0, 6, 12)
        for video in level.texture.videos:
            assert video.segments is not None and video.init is not None and video.container == "mp4"
            assert [segment.frames for segment in video.segments] == [6, 6, 2]
            ends = [part.offset + part.bytes for part in (video.init, *video.segments)]
            assert [segment.offset for segment in video.segments] == ends[:-1]


def test_levels_that_are_switched_share_meshes_and_places(whole: Path) -> None:
    small, full = parse_manifest(whole / "manifest.json").levels
    assert small.switchable == full.switchable == "full"
    assert small.meshes == full.meshes
    assert (2 * small.texture.width, 2 * small.texture.height) == (full.texture.width, full.texture.height)
    for one, other in zip(small.layers, full.layers, strict=True):
        assert tuple(2 * number for number in one.texture_rect) == other.texture_rect
        assert one.uv_window == other.uv_window


def test_frames_are_those_of_the_same_take_in_one_piece(whole: Path, tmp_path: Path) -> None:
    plain, stream = make_asset(tmp_path / "plain", layers=2, frames=FRAMES), read_asset(whole)
    assert sum(1 for _ in stream.frames()) == FRAMES
    for index in (0, 5, 6, 13):
        for a, b in zip(plain.frame(index), stream.frame(index), strict=True):
            top, left = (b.shape[0] - a.shape[0]) // 2, (b.shape[1] - a.shape[1]) // 2
            inner = b[top : top + a.shape[0], left : left + a.shape[1]].astype(int)
            assert np.abs(inner - a)[a[..., 3] > 60].mean() < 3
    for level in stream.levels:
        for index in (7, 13):
            every = list(level.frames())[index]
            assert all(np.array_equal(a, b) for a, b in zip(every, level.frame(index), strict=True))


@pytest.mark.parametrize("name", ["full.m3u8", "small_av1.m3u8", "stream.m3u8"])
def test_another_program_plays_what_leads_to_the_files(whole: Path, name: str) -> None:
    options = {"allowed_extensions": "ALL"} if name.endswith("m3u8") else {}
    with av.open(str(whole / name), options=options) as container:
        times = [float(frame.pts * frame.time_base) for frame in container.decode(video=0)]
    np.testing.assert_allclose(np.diff(times), 1 / 30, atol=1e-3)
    assert len(times) == FRAMES


def test_the_dash_manifest_lists_levels_of_a_codec_together(whole: Path) -> None:
    space = "{urn:mpeg:dash:schema:mpd:2011}"
    sets = list(ElementTree.parse(whole / "stream.mpd").iter(f"{space}AdaptationSet"))
    names = [[base.text for base in one.iter(f"{space}BaseURL")] for one in sets]
    assert names == [*([f"small{c}.mp4", f"full{c}.mp4"] for c in ("", "_vp9", "_av1")), ["audio.mp4"]]


def test_the_same_bytes_each_time(whole: Path, tmp_path: Path) -> None:
    streamed_asset(tmp_path / "again", SECTION, FRAMES, sound=True)
    for path in whole.iterdir():
        assert (tmp_path / "again" / path.name).read_bytes() == path.read_bytes(), path.name


def test_damage_is_found_in_its_segment_only(asset: Path) -> None:
    video = parse_manifest(asset / "manifest.json").full.texture.videos[0]
    data = bytearray((asset / video.file).read_bytes())
    found = read_asset(asset)
    data[video.segments[1].offset + 200] ^= 1
    (asset / video.file).write_bytes(data)
    found.frame(5), found.frame(12)
    with pytest.raises(UserError, match="damaged asset"):
        found.frame(8)
    assert any(problem.startswith(f"{video.file}:") for problem in validate_asset(asset))


Value = dict[str, Any]


def _video(value: Value) -> Any:
    return value["levels"][1]["texture"]["videos"][0]


WRONG: dict[str, tuple[Callable[[Value], Any], str]] = {
    "a gap": (lambda value: _video(value)["segments"][1].update(offset=9), "follow each other"),
    "a frame more": (lambda value: _video(value)["segments"][0].update(frames=7), "frames of 14"),
    "no header": (lambda value: _video(value).pop("init"), "come together"),
    "no key frame": (lambda value: value["levels"][1]["texture"].update(keyframes=[0, 6]), "begin with keyframes"),
    "beyond the file": (lambda value: _video(value).update(bytes=99), "inside the file"),
    "not switchable": (lambda value: value["levels"][0]["layers"][0].update(texture_rect=[4, 4, 16, 16]), "switchable"),
}


@pytest.mark.parametrize(("change", "word"), WRONG.values(), ids=WRONG)
def test_segments_that_cannot_be(asset: Path, change: Callable[[Value], Any], word: str) -> None:
    edit(asset, change)
    assert any(word in problem for problem in validate_asset(asset)), validate_asset(asset)
    with pytest.raises(UserError, match="damaged manifest"):
        read_asset(asset)


@pytest.mark.parametrize("sizes", [[(64, 64)] * 3, [(40, 24), (128, 64)], [(8, 8)]])
@pytest.mark.parametrize("unit", [1, 2, 4])
def test_a_layout_scaled_is_a_layout(sizes: list[tuple[int, int]], unit: int) -> None:
    whole = AtlasLayout.pack(sizes, unit)
    for factor in {1, unit}:
        small = whole.scaled(factor)
        assert small.problems() == [] and small.unit == unit // factor
        assert small.width % 16 == small.height % 16 == 0 and min(small.width, small.height) >= 128
        gutters = [min(rect[0], rect[1]) for rect in small.rects]
        assert min(gutters) >= 4 * small.unit
