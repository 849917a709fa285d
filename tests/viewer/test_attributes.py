"""What users of <model-viewer> expect of an element: attributes, properties and events of the same names."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.viewer.conftest import NO_WEBCODECS, NewPlayer, Player, drag, element, page_of_yours

START = (200, 120)
"""Of drags."""
VIEW = "[e.state.view.azimuth, e.state.view.elevation, e.state.view.distance]"


def numbers(player: Player, expression: str = VIEW) -> list[float]:
    return player.run(f"return {expression}")


def test_camera_orbit_is_the_first_view(new_player: NewPlayer, rich: Path) -> None:
    plain = element(new_player, rich)
    away = numbers(plain)[2]
    player = element(new_player, rich, 'camera-orbit="30deg 80deg 120%"')
    assert numbers(player) == pytest.approx([30, 10, 1.2 * away])
    player.run("e.state = {view: {azimuth: -20}}; e.resetView()")
    assert numbers(player)[0] == pytest.approx(30)
    player.run("e.setAttribute('camera-orbit', '-15deg auto 1.5m')")
    assert numbers(player) == pytest.approx([-15, 0, 1.5])
    player.run("e.removeAttribute('camera-orbit')")
    assert numbers(player) == pytest.approx([0, 0, away])


def test_camera_target_is_what_the_first_view_looks_at(new_player: NewPlayer, rich: Path) -> None:
    """glTF's axes: to the subject's left, up, before it."""
    player = element(new_player, rich, 'camera-target="0.1m auto -2cm"')
    middle = numbers(player, "e.player.home.centre")
    assert numbers(player, "e.state.view.target") == pytest.approx([-0.02, 0.1, middle[2]])
    player.run("e.state = {view: {target: [0, 0, 0]}}; e.resetView()")
    assert numbers(player, "e.state.view.target")[1] == pytest.approx(0.1)
    player.run("e.cameraTarget = 'auto'")
    assert numbers(player, "e.state.view.target") == pytest.approx(middle)


def test_a_page_bounds_the_view(new_player: NewPlayer, rich: Path) -> None:
    least, most = "-10deg 75deg 80%", "20deg 95deg 1.5m"
    player = element(new_player, rich, f'min-camera-orbit="{least}" max-camera-orbit="{most}"')
    away = numbers(player)[2]
    for asked, found in (((90, 60, 0.01), (20, 15, 0.8 * away)), ((-90, -60, 9), (-10, -5, 1.5))):
        view = dict(zip(("azimuth", "elevation", "distance"), asked, strict=True))
        player.run("e.state = {view: v}", view)
        assert numbers(player) == pytest.approx(found)
    drag(player, START, (-300, -200))
    assert numbers(player, "[e.player.view.goal.azimuth, e.player.view.goal.elevation]") == [20, -5]
    drag(player, START, (20, 0))  # at once: what was beyond the end is forgotten
    assert numbers(player, "[e.player.view.goal.azimuth]")[0] < 10
    player.run("e.minCameraOrbit = 'auto'; e.maxCameraOrbit = '30deg auto auto'; e.state = {view: {azimuth: 90}}")
    assert numbers(player)[0] == pytest.approx(30)


def test_panning_and_double_clicks_move_what_is_looked_at(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich)
    goal, home = "e.player.view.goal.target", numbers(player, "e.player.view.home.target")
    drag(player, START, (30, 0), "right")
    assert numbers(player, goal) != home
    player.run("e.resetView()")
    surface = "e.surfaceFromPoint(v[0], v[1])?.split(' ').map(Number)"
    place = player.run(f"return {surface}", [230, 110])
    player.page.mouse.dblclick(230, 110)
    player.wait(f"{goal}.every((v, i) => Math.abs(v - e.player.view.now.target[i]) < 1e-3)")
    middle = player.run("return [200, 150 - e.player.view.inset / 2]")
    assert place is not None and player.run(f"return {surface}", middle) == pytest.approx(place, abs=0.01)
    player.page.mouse.dblclick(3, 3)  # beside the head: the first view
    assert numbers(player, goal) == pytest.approx(home)
    player.run("e.disablePan = e.disableTap = true; e.resetView()")
    player.page.mouse.dblclick(230, 110)
    drag(player, START, (30, 0), "right")
    assert numbers(player, goal) == home
    assert numbers(player, "[e.player.view.goal.azimuth]")[0] < -5  # it turns instead


def test_what_a_script_gives_is_an_attribute_too(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich}, viewport={"width": 400, "height": 300})
    page_of_yours(player, "<facefolds-player></facefolds-player>")
    player.run("await customElements.whenDefined('facefolds-player'); e.alt = 'Caps'; e.src = 'asset/'")
    player.wait("e.ready")
    assert player.run("return [e.src, e.getAttribute('alt'), e.loading]") == ["asset/", "Caps", "auto"]


def test_a_page_says_when_it_is_revealed(new_player: NewPlayer, rich: Path) -> None:
    """Until then there is the asset's poster, and nothing else is fetched."""
    player = new_player({"asset": rich}, viewport={"width": 400, "height": 300})
    page_of_yours(player, '<facefolds-player src="asset/" reveal="manual" autoplay></facefolds-player>')
    player.wait("e.shadowRoot?.querySelector('.poster').naturalWidth > 0")
    assert player.page.locator(".poster").is_visible() and not player.page.locator(".bar").is_visible()
    fetched = {address.split("/asset/")[1] for address in player.requests if "/asset/" in address}
    assert fetched == {"manifest.json", "poster.png"}
    player.run("e.dismissPoster()")
    player.wait("e.ready && e.playing")
    assert player.page.locator(".bar").is_visible()


def test_a_narrower_field_of_view_shows_the_same_from_further_away(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, 'background="#00ff00" controls="none"')
    before, away = player.capture(), numbers(player)[2]
    player.run("e.setAttribute('field-of-view', '12deg')")
    after = player.capture()
    assert numbers(player)[2] > 2 * away
    widths = [np.flatnonzero((np.abs(one[..., :3] - (0, 1, 0)).max(-1) > 0.1).any(0)) for one in (before, after)]
    assert np.ptp(widths[1]) == pytest.approx(np.ptp(widths[0]), rel=0.15)


def test_camera_controls_and_zoom_can_be_switched_off(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, "disable-zoom")
    before = numbers(player)
    player.page.mouse.click(200, 100)
    player.page.mouse.wheel(0, -300)
    player.page.keyboard.press("+")
    player.page.wait_for_timeout(300)
    assert numbers(player) == before
    player.page.keyboard.press("Shift+ArrowRight")
    assert numbers(player)[0] == pytest.approx(before[0] + 5)
    player.run("e.removeAttribute('disable-zoom'); e.setAttribute('camera-controls', 'none'); e.resetView()")
    drag(player, START, (-100, 0))
    for key in ("Shift+ArrowRight", "+"):
        player.page.locator("[data-do=play]").press(key)
    player.page.wait_for_timeout(300)
    assert numbers(player) == before


def test_it_turns_by_itself_and_again_after_a_touch(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, "auto-rotate")
    first = player.capture()
    player.page.wait_for_timeout(1500)
    assert np.abs(player.capture() - first).max() > 0.1
    player.page.mouse.click(200, 100)
    assert player.run("return e.player.view.swaying") == 0
    player.wait("e.player.view.swaying > 0.2")
    player.run("e.removeAttribute('auto-rotate')")
    assert player.run("return [e.player.view.swaying, e.playing]") == [0, False]


def test_with_reduced_motion_it_does_not_turn(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, "auto-rotate", reduced_motion="reduce")
    player.page.wait_for_timeout(300)
    assert player.run("return e.player.view.swaying") == 0


def test_alt_names_the_picture_and_who_does_nothing_is_prompted(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, 'alt="Ann, who laughs" interaction-prompt="auto"')
    assert player.notice() == "Drag to turn"
    player.page.get_by_role("img", name="Ann, who laughs").wait_for()
    player.run("e.removeAttribute('alt')")
    player.page.get_by_role("img", name="Three-dimensional picture").wait_for()


def test_time_and_sound(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, 'muted="false"')
    player.wait("e.player.sound")
    assert player.run("return [e.muted, e.player.sound.muted]") == [False, False]
    player.run("e.muted = true")
    assert player.run("return e.player.sound.muted") is True
    duration, fps = numbers(player, "[e.duration, e.fps]")
    assert duration == pytest.approx(6 / fps)
    player.run("e.currentTime = 3.5 / e.fps")
    player.wait("e.frame === 3")
    assert player.run("return e.currentTime") == pytest.approx(3 / fps)


@pytest.mark.parametrize(
    "script",
    ["", pytest.param(NO_WEBCODECS, marks=pytest.mark.nightly)],
    ids=["WebCodecs", "video element"],
)
def test_events(new_player: NewPlayer, rich: Path, script: str) -> None:
    listen = """window.seen = {}; for (const name of ['load', 'progress', 'camera-change', 'ended', 'pause'])
        addEventListener(name, ({ type, detail }) => (seen[type] ??= []).push(detail?.totalProgress), true);"""
    player = element(new_player, rich, 'loop="false"', script=script + ";" + listen)
    player.wait("seen.load")
    progress = numbers(player, "seen.progress")
    assert min(progress) < 0.9 and max(progress) == 1
    player.run("seen['camera-change'] = []; e.state = {view: {azimuth: 20}}")
    player.wait("seen['camera-change'].length === 1")
    player.run("e.play()")
    player.wait("seen.ended?.length === 1 && e.frame === 5 && !e.playing")
    assert player.run("return seen['camera-change'].length") == 1


def test_a_page_may_open_with_the_photo(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, 'photo="1" controls="none"')
    player.wait("!e.shadowRoot.querySelector('.compare').hidden")
    assert player.run("return [e.state.photo, e.player.view.exact?.camera]") == [1, "photo1"]
    assert player.page.get_by_role("slider", name="Border between asset and photo").is_visible()


def test_a_picture_of_what_is_seen_and_parts_that_are_styled(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich)
    code = """const blob = await e.toBlob(v); const bytes = new Uint8Array(await blob.arrayBuffer());
        return [blob.type, btoa(String.fromCharCode(...bytes))];"""
    for options, kind in (({}, "image/png"), ({"mimeType": "image/jpeg", "qualityArgument": 0.9}, "image/jpeg")):
        found, data = player.run(code, options)
        assert found == kind
        picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")) / 255
        assert np.abs(picture - player.capture()[..., :3]).mean() < 0.02

    player.run("const sheet = new CSSStyleSheet(); document.adoptedStyleSheets.push(sheet);"
               "sheet.replaceSync('facefolds-player::part(bar) { border-radius: 3px }')")  # fmt: skip
    assert player.run("return getComputedStyle(e.shadowRoot.querySelector('.bar')).borderRadius") == "3px"
