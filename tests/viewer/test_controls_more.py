"""What the player offers beside playing: other views, pictures, code to embed; small, idle, for all eyes and keys."""

from __future__ import annotations

import base64
import io
import shlex
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from facefolds_core.asset import read_asset
from facefolds_core.rendering.pixels import render
from tests.pictures import five_cameras, psnr
from tests.viewer.conftest import NewPlayer, Player, Show, page_of_yours


@pytest.fixture
def player(show: Show) -> Player:
    return show(full=True, viewport={"width": 760, "height": 500})


def test_opacity_depth_and_texture_coordinates(player: Player, rich: Path) -> None:
    asset, camera = read_asset(rich), five_cameras(160)[0]
    _, alpha = render(asset, camera, 0)
    player.button("Settings")
    show = player.page.get_by_label("Show")
    show.select_option("Opacity")
    seen = player.capture(camera)
    assert psnr(seen[..., 0], alpha) >= 40
    assert np.ptp(seen[..., :3], axis=-1).max() == 0  # grey
    solid = alpha > 0.98
    show.select_option("Depth")
    depth = player.capture(camera)[..., 0]
    rows, columns = np.nonzero(solid)
    middle = np.hypot(rows - rows.mean(), columns - columns.mean())
    assert depth[solid][middle < 8].mean() > depth[solid][middle > 0.8 * middle.max()].mean()  # nearer is brighter
    found = depth[alpha > 0.5]
    assert np.quantile(found, 0.02) < 0.25 and np.quantile(found, 0.98) > 0.75  # all greys, for what is seen
    show.select_option("Texture coordinates")
    uv = player.capture(camera)
    assert np.abs(uv[..., 2][solid] - 0.35).max() < 0.02
    assert np.corrcoef(uv[..., 0][solid], columns)[0, 1] > 0.9  # s to the right
    assert np.corrcoef(uv[..., 1][solid], rows)[0, 1] > 0.9  # t down


def test_a_picture_is_saved(player: Player) -> None:
    player.page.locator("canvas").focus()
    with player.page.expect_download() as download:
        player.page.keyboard.press("i")
    assert download.value.suggested_filename == "caps-1.png"
    saved = np.asarray(Image.open(io.BytesIO(Path(download.value.path()).read_bytes())).convert("RGBA")) / 255
    assert np.abs(saved - player.capture()).max() <= 1 / 255


def film_of(path: Path) -> tuple[list[np.ndarray], float, np.ndarray]:
    """Pictures of a film as grey, its seconds, and its sound (N,) if it has one."""
    with av.open(str(path)) as film:
        frames = list(film.decode(video=0))
    with av.open(str(path)) as film:
        sound = [part.to_ndarray().mean(0) for part in film.decode(audio=0)] if film.streams.audio else []
        rate = float(frames[1].time - frames[0].time) if len(frames) > 1 else 0.0
    pictures = [frame.to_ndarray(format="gray").astype(float) for frame in frames]
    return pictures, float(frames[-1].time) + rate, np.concatenate(sound or [np.empty(0)])


def test_a_turn_is_recorded(player: Player, tmp_path: Path) -> None:
    """As long as was asked for, whatever the machine's speed; the camera moves in each picture; with the sound."""
    player.run("e.player.view.set({azimuth: 5, elevation: 3, distance: 1.1, target: [0, 0, 0]}); await e.seek(2)")
    before = player.run("return [e.player.view.get(), e.playing, e.frame]")
    code = """const film = await e.record({seconds: 1.5, degrees: 30});
        const text = await new Promise((done) => {
            const reader = new FileReader(); reader.onload = () => done(reader.result); reader.readAsDataURL(film); });
        return [film.type, text.split(',')[1]];"""
    kind, data = player.run(code)
    assert kind in ("video/mp4", "video/webm")
    (tmp_path / "turn").write_bytes(base64.b64decode(data))
    pictures, seconds, sound = film_of(tmp_path / "turn")
    assert len(pictures) == 45 and seconds == pytest.approx(1.5, abs=0.01)
    steps = [np.abs(b - a).mean() for a, b in pairwise(pictures)]
    assert min(steps) > 0.02 and max(np.abs(one - pictures[0]).mean() for one in pictures) > 5
    assert len(sound) == pytest.approx(1.5 * 48000, rel=0.02) and np.abs(sound[-24000:]).max() > 0.01  # it loops, too
    assert player.run("return [e.player.view.get(), e.playing, e.frame]") == before


def test_a_recording_is_ended_and_saved(player: Player) -> None:
    player.button("Settings")
    record = player.page.get_by_role("button", name="Record a turn")
    record.click()
    player.page.wait_for_timeout(1000)
    with player.page.expect_download() as download:
        record.click()
    name = download.value.suggested_filename
    assert name in ("caps-turn.mp4", "caps-turn.webm")
    assert len(film_of(Path(download.value.path()))[0]) >= 1
    assert record.get_attribute("aria-pressed") == "false"


def test_a_browser_that_cannot_record_says_what_does(show: Show) -> None:
    player = show(script="delete globalThis.VideoEncoder", viewport={"width": 760, "height": 500})
    player.button("Settings")
    player.button("Record a turn")
    player.page.locator(".toast", has_text="facefolds render ASSET --kind turntable").wait_for()


def embed_code(player: Player) -> tuple[str, str]:
    """What the dialog offers, as a frame and as an element."""
    player.run("e.player.view.set({azimuth: 12, elevation: 3, distance: 1.1, target: [0, 0, 0]})")
    player.button("Settings")
    player.button("Embed")
    return player.page.get_by_label("As a frame").input_value(), player.page.get_by_label("As an element").input_value()


def test_the_code_to_embed_plays(player: Player) -> None:
    """From this machine: the code is for what is uploaded as player/ and player/asset/."""
    frame, element = embed_code(player)
    assert player.page.get_by_text("Only this machine can reach").is_visible()
    command = "facefolds export-html data/caps/asset --out caps.html"
    assert player.page.get_by_label("One file").input_value() == command  # what a shell takes, and nothing else
    player.run("e.setAttribute('folder', v)", "data/ann's takes/asset")
    player.run("e.openEmbed()")
    quoted = player.page.get_by_label("One file").input_value().removeprefix("facefolds export-html ")
    assert shlex.split(quoted) == ["data/ann's takes/asset", "--out", "caps.html"]
    assert player.page.get_by_label("and this code plays it").input_value().startswith('<iframe src="caps.html"')
    hidden = "[...e.shadowRoot.querySelectorAll('textarea')].filter((one) => one.scrollHeight > one.clientHeight)"
    assert player.run(f"return {hidden}.length") == 0
    player.page.keyboard.press("Escape")
    assert player.run("return [e.shadowRoot.querySelector('dialog').open]") == [False]
    assert "view=12,3,1.1,0,0,0" in frame
    assert "127.0.0.1" not in frame + element
    page_of_yours(player, (element + frame).replace("player/", ""))
    player.wait("e.ready")
    player.page.locator("iframe").scroll_into_view_if_needed()
    player.page.frame_locator("iframe").locator("facefolds-player canvas").wait_for()


def test_the_code_to_embed_from_a_server_has_its_address_and_what_it_must_allow(
    new_player: NewPlayer, rich: Path
) -> None:
    player = new_player({"asset": rich}, viewport={"width": 760, "height": 500})
    local, player.address = player.address, "https://faces.example/"
    player.page.route(
        "https://faces.example/**",
        lambda route: route.fulfill(response=route.fetch(url=route.request.url.replace(player.address, local))),
    )
    player.open("asset")
    frame, element = embed_code(player)
    assert 'src="https://faces.example/index.html?src=%2Fasset%2F#view=12,3,1.1,0,0,0' in frame
    assert 'src="https://faces.example/facefolds-player.js"' in element
    assert player.page.get_by_text("frame-ancestors").is_visible()
    assert not player.page.get_by_label("One file").is_visible()


def test_rows_of_the_settings_go_under_their_title(show: Show) -> None:
    player = show("frame=0&background=%23ffffff", viewport={"width": 390, "height": 700})
    player.button("Settings")
    box = player.box(".panel .head")
    title = {"x": box["x"] + 2, "y": box["y"] + 8, "width": 240, "height": box["height"] - 10}
    before = player.page.screenshot(clip=title)
    player.run("e.shadowRoot.querySelector('.panel').scrollTop = 170")
    assert player.page.screenshot(clip=title) == before


def test_backgrounds_stand_in_one_row(show: Show) -> None:
    player = show()
    for width in (390, 760):
        player.page.set_viewport_size({"width": width, "height": 600})
        if not player.page.locator(".panel").is_visible():
            player.button("Settings")
        boxes = player.boxes(".swatches div > *")
        assert len(boxes) == 9 and len({box["y"] for box in boxes}) == 1
        assert min(min(box["width"], box["height"]) for box in boxes) >= 24  # for fingers


def test_words_and_figures_fit_a_small_player(show: Show) -> None:
    player = show(viewport={"width": 360, "height": 240})
    player.run("e.overlays.say('Cameras saw too little from further round'); e.overlays.showStatistics(true)")
    toast, stats, bar = (player.box(name) for name in (".toast", ".stats", ".bar"))
    assert toast["height"] < 50 and toast["x"] >= 0 and toast["x"] + toast["width"] <= 360
    assert stats["y"] >= 0 and stats["y"] + stats["height"] <= bar["y"]


def test_escape_closes_what_is_open(player: Player) -> None:
    player.button("Settings")
    player.page.keyboard.press("Escape")
    assert not player.page.locator(".panel").is_visible()
    assert player.run("return e.shadowRoot.activeElement.dataset.do") == "settings"


def test_the_bar_goes_while_it_plays_and_comes_back(player: Player) -> None:
    player.page.mouse.move(300, 100)
    player.run("e.speed = 0.1; e.play()")
    idle = "e.shadowRoot.querySelector('.stage').classList.contains('idle')"
    player.wait(idle)
    player.page.mouse.move(320, 120)
    player.wait(f"!{idle}")
    player.run("e.pause()")
    player.page.wait_for_timeout(3300)
    assert not player.run(f"return {idle}")


@pytest.mark.parametrize(
    ("width", "height"), [(360, 640), pytest.param(280, 160, marks=pytest.mark.nightly), (240, 320)]
)
def test_a_phone_shows_all_its_buttons_a_small_player_what_it_needs_in_one_line(
    show: Show, width: int, height: int
) -> None:
    player = show(viewport={"width": width, "height": height})
    player.wait("e.player.sound !== null")
    boxes = player.boxes(".bar button:visible")
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in boxes)
    if width == 360:
        assert len(boxes) >= 8
    else:
        assert len(boxes) == 3 and len({round(box["y"]) for box in boxes}) == 1


def test_forced_colours_show_what_is_pressed_and_the_counter_is_quiet(player: Player) -> None:
    """A screen reader is not told every frame."""
    player.page.emulate_media(forced_colors="active")
    look = "return getComputedStyle(e.shadowRoot.querySelector(`[data-do=${v}]`)).backgroundColor"
    assert player.run(look, "loop") != player.run(look, "settings")
    assert player.run("return [...e.shadowRoot.querySelectorAll('.bar output, .bar [aria-live]')].length") == 0
    assert player.run("return e.shadowRoot.querySelector('.count').ariaHidden") == "true"


def test_a_page_with_a_strict_policy(new_player: NewPlayer, rich: Path) -> None:
    """No inline styles, no blobs of scripts: only what must be."""
    player = new_player({"asset": rich})
    policy = (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; "
        "img-src 'self' blob: data:; media-src blob:; style-src 'self'"
    )
    page_of_yours(player, '<facefolds-player src="asset/"></facefolds-player>', style="", policy=policy)
    player.wait("e.level === 'full'")
