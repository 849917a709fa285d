"""The web player's pixels against the reference renderer's, read back from the browser."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset import Asset
from facefolds_core.asset.writer import AssetSource
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.areas import AreaView
from facefolds_core.rendering.pixels import lit_hits, render
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import seen_from
from tests.assets import MOVING, OVER_TORSO, make_asset
from tests.pictures import GREY, GREY_VALUE, expected_pictures, five_cameras, psnr
from tests.viewer.conftest import NO_WEBCODECS, Player, Show
from tests.viewer.fixtures import moving_asset, shining

SIZE = 160
AGREE = 53.0
"""dB to means over pixels. Seen: 55.2 and more at 160 pixels, 55.4 at 96; the canvas rounds to 8 bits after each layer.
One ray a pixel: 45.0 and 42.4 at grazing angles."""


@pytest.fixture(scope="module")
def caps(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    return make_asset(tmp_path_factory.mktemp("caps") / "asset", layers=5, frames=6, resolution=96)


def on_grey(show: Show, asset: Asset, frame: int = 0, **options: object) -> Player:
    player = show(asset=asset.folder, **options)
    assert player.run("e.background = v[0]; return await e.seek(v[1])", [GREY, frame])
    return player


def agrees(player: Player, camera: Camera, expected: NDArray[np.float32]) -> bool:
    return psnr(player.capture(camera)[..., :3], expected) >= AGREE


def of_pixel_means(asset: Asset, camera: Camera, frame: int = 0) -> NDArray[np.float32]:
    return expected_pictures(asset, [camera], [frame], means=True)[camera.name, frame]


@pytest.mark.parametrize(("size", "script"), [(SIZE, ""), (SIZE, NO_WEBCODECS), (96, "")])
def test_five_cameras_and_three_frames_agree_with_the_reference(
    show: Show, caps: Asset, size: int, script: str
) -> None:
    """Also without WebCodecs: older browsers, and pages without HTTPS."""
    player = on_grey(show, caps, script=script)
    player.run("e.effects = false")
    cameras, frames = five_cameras(size), (0, caps.num_frames // 2, caps.num_frames - 1)
    expected = expected_pictures(caps, cameras, frames, means=True)
    for frame in frames:
        assert player.run("return await e.seek(v)", frame)
        for camera in cameras:
            assert agrees(player, camera, expected[camera.name, frame]), (camera.name, frame)


def test_where_pictures_come_late_what_moves_has_one_ray_a_pixel(show: Show, caps: Asset) -> None:
    """At rest and in captures a pixel is always a mean."""
    player = on_grey(show, caps)
    player.wait("e.statistics.rays === 4")
    player.run("e.player.hurry(); e.play()")
    player.wait("e.statistics.rays === 1")
    player.run("e.pause()")
    player.wait("e.statistics.rays === 4")
    player.run("await e.seek(0)")
    camera = five_cameras(96)[4]
    assert agrees(player, camera, of_pixel_means(caps, camera))


def test_a_machine_that_cannot_draw_it_finer_has_one_ray_a_pixel(show: Show, caps: Asset) -> None:
    script = """const own = WebGL2RenderingContext.prototype.getParameter;
        WebGL2RenderingContext.prototype.getParameter = function (name) {
            return name === this.MAX_RENDERBUFFER_SIZE ? 180 : own.call(this, name); };"""
    player = on_grey(show, caps, script=script)
    assert player.run("return e.statistics.rays") == 1
    for size in (96, 90):
        camera = five_cameras(size)[4]
        assert agrees(player, camera, expected_pictures(caps, [camera], [0], means=size == 90)[camera.name, 0])


def test_the_canvas_shows_what_is_captured(show: Show, caps: Asset) -> None:
    player = on_grey(show, caps, 3, view="view=30,10,0.9,0,0,0&frame=3")
    player.run("e.setAttribute('controls', 'none')")
    player.page.wait_for_timeout(300)
    box = player.page.locator("canvas").screenshot(path=None, animations="disabled")
    shown = np.asarray(Image.open(io.BytesIO(box)).convert("RGB")) / 255
    assert psnr(shown, player.capture()[..., :3]) >= 50


def test_a_transparent_background_stays_transparent(show: Show, caps: Asset) -> None:
    player, camera = show(asset=caps.folder), five_cameras(SIZE)[0]
    player.run("e.background = 'transparent'")
    rgb, alpha = render(caps, camera, 0)
    assert psnr(player.capture(camera)[..., 3], alpha) >= AGREE
    assert agrees(player, camera, rgb)  # premultiplied: the composite over black


def test_reflections_follow_the_format(show: Show, caps: Asset, tmp_path: Path) -> None:
    asset, camera = shining(caps, tmp_path / "asset"), five_cameras(SIZE)[1]
    player = on_grey(show, asset)
    expected, _ = render(asset, camera, 0, (GREY_VALUE,) * 3)
    assert agrees(player, camera, expected)
    player.run("e.effects = false")
    plain = of_pixel_means(asset, camera)
    assert agrees(player, camera, plain)
    assert psnr(plain, expected) < 25  # the reflection is strong enough to be seen in this test


def test_exposure_is_a_factor_of_the_light(show: Show, caps: Asset) -> None:
    """Of each layer's, not of the background; stored values are sRGB's."""
    player, camera = on_grey(show, caps), five_cameras(SIZE)[1]
    player.run("e.exposure = 1.5")
    view = AreaView.of_hits(camera, lambda part: (cast_layers(part, caps.layers), None))
    brighter = [exposed(np.asarray(texture), 1.5) for texture in caps.frame(0)]
    expected, _ = view.composite(brighter, (GREY_VALUE,) * 3)
    plain, _ = view.composite(caps.frame(0), (GREY_VALUE,) * 3)
    assert agrees(player, camera, expected)
    assert psnr(plain, expected) < 30  # it is strong enough to be seen in this test
    player.run("e.removeAttribute('exposure')")
    assert agrees(player, camera, plain)


def exposed(rgba: NDArray[np.generic], factor: float) -> NDArray[np.float32]:
    """An RGBA texture with so many times the light."""
    values = np.asarray(rgba, np.float32) / (255 if rgba.dtype == np.uint8 else 1)
    stored = values[..., :3]
    light = factor * np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    back = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.concatenate([np.minimum(back, 1), values[..., 3:]], -1).astype(np.float32)


@pytest.mark.parametrize("source", [MOVING, OVER_TORSO], ids=["whole", "over a torso"])
def test_a_head_that_moves_stands_where_it_stood(source: AssetSource, show: Show, tmp_path: Path) -> None:
    asset = make_asset(tmp_path / "asset", layers=3, frames=3, resolution=64, source=source)
    player, camera = on_grey(show, asset, 2), five_cameras(SIZE)[1]
    moved, _ = render(asset, camera, 2, (GREY_VALUE,) * 3)
    at_rest = of_pixel_means(asset, camera, 2)
    assert agrees(player, camera, moved)
    player.run("e.still = true")
    assert agrees(player, camera, at_rest)
    assert psnr(moved, at_rest) < 25  # the motion is large enough to be seen in this test


def test_the_light_stays_with_the_room_where_the_head_turns(show: Show, tmp_path: Path) -> None:
    """Also where the head is held still: the room turns around it."""
    asset, camera = moving_asset(tmp_path / "asset", layers=3, resolution=64), five_cameras(SIZE)[1]
    assert asset.reflection() is not None and asset.track is not None
    player = on_grey(show, asset, 2)
    for still in (False, True):
        player.run("e.still = v", still)
        seen_by = camera if still else seen_from(asset, camera, 2)
        expected, along = (shown(asset, seen_by, frame) for frame in (2, 0))
        assert agrees(player, camera, expected), still
        assert psnr(along, expected) < 36  # light that turns with the head is another picture


def shown(asset: Asset, camera: Camera, room: int) -> NDArray[np.float32]:
    """Frame 2 by a camera of the meshes' own frame, in the room's light as it falls on the head in frame `room`."""
    view = AreaView.of_hits(camera, lit_hits(asset, room, lambda part: cast_layers(part, asset.layers)))
    return view.composite(asset.frame(2), (GREY_VALUE,) * 3)[0]
