"""The web player's pixels against the reference renderer's, read back from the browser."""

from __future__ import annotations

import io
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from facefolds_core.asset import Asset, read_asset
from facefolds_core.rendering import AssetCaster, composite, render_asset
from facefolds_core.rendering.reflection import reflected_colours
from tests.asset.test_track import TRACK
from tests.assets import SOURCE, make_asset
from tests.pictures import GREY, GREY_VALUE, expected_pictures, five_cameras, psnr
from tests.viewer.conftest import NewPlayer
from tests.viewer.fixtures import add_reflection

SIZE = 160
AGREE = 50.0
"""dB. Seen: 53.7 and more; the canvas rounds to 8 bits after each layer."""


@pytest.fixture(scope="module")
def caps(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    folder = tmp_path_factory.mktemp("caps") / "asset"
    make_asset(folder, layers=5, frames=6, resolution=96)
    return read_asset(folder)


def check(new_player: NewPlayer, asset: Asset, allow: float = AGREE, script: str = "") -> None:
    """Five cameras, first, middle and last frame."""
    player = new_player({"asset": asset.folder}, script=script)
    player.open("asset")
    player.run("e.background = v; e.effects = false", GREY)
    cameras, frames = five_cameras(SIZE), (0, asset.num_frames // 2, asset.num_frames - 1)
    expected = expected_pictures(asset, cameras, frames)
    for frame in frames:
        assert player.run("return await e.seek(v)", frame)
        for camera in cameras:
            found = player.capture(camera)[..., :3]
            assert psnr(found, expected[camera.name, frame]) >= allow, (camera.name, frame)


def test_five_cameras_and_three_frames_agree_with_the_reference(new_player: NewPlayer, caps: Asset) -> None:
    check(new_player, caps)


def test_the_video_element_shows_the_same(new_player: NewPlayer, caps: Asset) -> None:
    """Without WebCodecs: older browsers, and pages without HTTPS."""
    check(new_player, caps, script="delete globalThis.VideoDecoder")


def test_the_canvas_shows_what_is_captured(new_player: NewPlayer, caps: Asset) -> None:
    player = new_player({"asset": caps.folder})
    player.open("asset", "view=30,10,0.9,0,0,0&frame=3")
    player.run("e.setAttribute('controls', 'none'); e.background = v", GREY)
    player.page.wait_for_timeout(300)
    box = player.page.locator("canvas").screenshot(path=None, animations="disabled")
    shown = np.asarray(Image.open(io.BytesIO(box)).convert("RGB")) / 255
    assert psnr(shown, player.capture()[..., :3]) >= 50


def test_a_transparent_background_stays_transparent(new_player: NewPlayer, caps: Asset) -> None:
    player = new_player({"asset": caps.folder})
    player.open("asset")
    player.run("e.background = 'transparent'")
    camera = five_cameras(SIZE)[0]
    found = player.capture(camera)
    rgb, alpha = composite(AssetCaster(caps).cast(camera), caps.frame(0))
    assert psnr(found[..., 3], alpha) >= AGREE
    assert psnr(found[..., :3], rgb) >= AGREE  # premultiplied: the composite over black


def test_reflections_follow_the_format(new_player: NewPlayer, caps: Asset, tmp_path: Path) -> None:
    folder = tmp_path / "asset"
    shutil.copytree(caps.folder, folder)
    add_reflection(folder)
    asset = read_asset(folder)
    player = new_player({"asset": folder})
    player.open("asset")
    player.run("e.background = v", GREY)
    camera = five_cameras(SIZE)[1]
    maps, hits = asset.full.reflection(), AssetCaster(asset).cast(camera)
    assert maps is not None
    added = reflected_colours(hits, camera, asset.full.windows, maps)
    expected, _ = composite(hits, asset.frame(0), (GREY_VALUE,) * 3, added)
    assert psnr(player.capture(camera)[..., :3], expected) >= AGREE
    player.run("e.effects = false")
    plain = expected_pictures(asset, [camera], [0])[camera.name, 0]
    assert psnr(player.capture(camera)[..., :3], plain) >= AGREE
    assert psnr(plain, expected) < 25  # the reflection is strong enough to be seen in this test


def test_a_head_that_moves_stands_where_it_stood(new_player: NewPlayer, tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=3, frames=3, resolution=64, source=replace(SOURCE, track=TRACK))
    asset = read_asset(tmp_path / "asset")
    player = new_player({"asset": asset.folder})
    player.open("asset")
    player.run("e.background = v; e.effects = false", GREY)
    assert player.run("return await e.seek(v)", 2)
    camera = five_cameras(SIZE)[1]
    moved, _ = render_asset(asset, camera, 2, (GREY_VALUE,) * 3)
    at_rest = expected_pictures(asset, [camera], [2])[camera.name, 2]
    assert psnr(player.capture(camera)[..., :3], moved) >= AGREE
    player.run("e.still = true")
    assert psnr(player.capture(camera)[..., :3], at_rest) >= AGREE
    assert psnr(moved, at_rest) < 25  # the motion is large enough to be seen in this test


def test_the_light_stays_with_the_room_where_the_head_turns(new_player: NewPlayer, tmp_path: Path) -> None:
    """Also where the head is held still: the room turns around it."""
    make_asset(tmp_path / "asset", layers=3, frames=3, resolution=64, source=replace(SOURCE, track=TRACK))
    add_reflection(tmp_path / "asset")
    asset, camera = read_asset(tmp_path / "asset"), five_cameras(SIZE)[1]
    maps, textures = asset.reflection(), asset.frame(2)
    assert maps is not None and asset.track is not None
    room, windows = asset.track.at(2).rotation, asset.full.windows
    player = new_player({"asset": asset.folder})
    player.open("asset")
    player.run("e.background = v", GREY)
    assert player.run("return await e.seek(v)", 2)
    for still in (False, True):
        player.run("e.still = v", still)
        seen_by = camera if still else asset.camera_in_head(camera, 2)
        hits = AssetCaster(asset).cast(seen_by)
        grey = (GREY_VALUE,) * 3
        expected, _ = composite(hits, textures, grey, reflected_colours(hits, seen_by, windows, maps, room))
        along, _ = composite(hits, textures, grey, reflected_colours(hits, seen_by, windows, maps))
        assert psnr(player.capture(camera)[..., :3], expected) >= AGREE, still
        assert psnr(along, expected) < 36  # light that turns with the head is another picture
