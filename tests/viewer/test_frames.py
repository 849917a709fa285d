"""Frame k means frame k: after any seek, while playing, round the end of a loop, with any codec and decoder."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from tests.assets import make_asset
from tests.pictures import five_cameras, means_of_frames, psnr
from tests.viewer.conftest import NO_WEBCODECS, Player, Show
from tests.viewer.fixtures import change_manifest

CAMERA = five_cameras(64)[0]
DECODERS = pytest.mark.parametrize("script", ["", NO_WEBCODECS], ids=["WebCodecs", "video element"])


@pytest.fixture(scope="module")
def pictures(rich: Path) -> list[np.ndarray]:
    """What each frame looks like."""
    return means_of_frames(read_asset(rich), CAMERA)


def nearest(player: Player, pictures: list[np.ndarray]) -> int:
    """Number of the frame that the player's picture is most like; it must be much more like it than any other."""
    scores = [psnr(player.capture(CAMERA)[..., :3], picture) for picture in pictures]
    best = int(np.argmax(scores))
    others = max(score for k, score in enumerate(scores) if k != best)
    assert scores[best] > others + 8
    return best


@DECODERS
def test_every_seek_shows_the_frame_asked_for(opened: Show, pictures: list[np.ndarray], script: str) -> None:
    player = opened(script=script)
    for frame in (5, 0, 3, 2, 4, 1, 5, 5):
        assert player.run("return await e.seek(v)", frame)
        assert player.run("return e.frame") == frame
        assert nearest(player, pictures) == frame


@pytest.mark.parametrize("codec", ["vp9", "av1"])
def test_the_other_videos_have_the_same_frames(
    opened: Show, pictures: list[np.ndarray], rich_copy: Path, codec: str
) -> None:
    """The videos before it are of a codec that no browser knows: the next one plays."""

    def change(value: dict) -> None:
        for video in value["levels"][1]["texture"]["videos"]:
            if video["codec"] != codec:
                video["mime"] = 'video/mp4; codecs="hvc9.1.6.L93.B0"'

    change_manifest(rich_copy, change)
    player = opened(asset=rich_copy)
    assert player.run("return e.statistics.video") == codec
    for frame in (5, 2, 0, 3):
        player.run("await e.seek(v)", frame)
        assert nearest(player, pictures) == frame


def test_of_many_seeks_the_last_wins(opened: Show, pictures: list[np.ndarray]) -> None:
    player = opened()
    done = player.run("const all = [5, 1, 4, 2, 3].map((k) => e.seek(k)); return Promise.all(all)")
    assert done[-1] is True
    assert nearest(player, pictures) == 3


@DECODERS
def test_playing_goes_round_without_a_gap(opened: Show, script: str) -> None:
    """Frames come in order and wrap round; slowly enough that software rendering need not leave any out."""
    player = opened(script=script)
    frames = player.run(
        """const seen = [];
        e.addEventListener('frame', () => seen.push(e.frame));
        e.speed = 0.1; e.play();
        while (seen.length < 15) await new Promise((next) => setTimeout(next, 20));
        e.pause();
        return seen.slice(0, 15);"""
    )
    steps = {(after - before) % 6 for before, after in pairwise(frames)}
    assert steps <= {0, 1, 2}
    assert set(frames) == set(range(6))


def test_while_playing_the_picture_is_that_of_the_frame_named(opened: Show, pictures: list[np.ndarray]) -> None:
    """Colour and alpha come from one frame, and `frame` says which; looked at in the middle of playing."""
    player = opened()
    player.run("e.speed = 0.1; e.play()")
    for _ in range(4):
        player.page.wait_for_timeout(170)
        frame = player.run("e.player.playback.speed = 1e-6; return e.frame")
        assert nearest(player, pictures) == frame
        player.run("e.player.playback.speed = 0.1")


def test_without_loop_it_stops_at_the_end_and_starts_again(show: Show) -> None:
    player = show(full=True)
    player.run("e.loop = false; await e.seek(3); e.play()")
    player.wait("!e.playing && e.frame === 5")
    player.run("e.speed = 0.1; e.play()")
    player.wait("e.playing && e.frame < 4")
    # A last frame that is decoded late is shown.
    player.run(
        """const { source } = e.player.level; const peek = source.peek.bind(source);
        e.pause(); e.speed = 100; await e.seek(3);
        source.peek = (k) => (k === 5 && !e.playing ? ((source.peek = peek), null) : peek(k));
        e.play();"""
    )
    player.wait("!e.playing && e.frame === 5")


def test_a_still_asset_has_one_frame(show: Show, tmp_path: Path) -> None:
    player = show("", asset=make_asset(tmp_path / "asset", layers=1, frames=1, resolution=32).folder)
    assert player.run("return [e.frame, e.frames]") == [0, 1]
    assert player.page.get_by_role("button", name="Play").is_disabled()
