"""Every control of the player does what it says, by pointer, by key and through the element's API."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from tests.viewer.conftest import NewPlayer, Player, Show, drag, page_of_yours, swipe


@pytest.fixture
def player(show: Show) -> Player:
    allowed = ["clipboard-write", "clipboard-read"]
    return show(full=True, viewport={"width": 760, "height": 500}, permissions=allowed)


def value(player: Player, expression: str) -> object:
    return player.run(f"return {expression}")


def changes_picture(player: Player, act: object) -> bool:
    before = player.capture()
    act()
    return bool(np.abs(player.capture() - before).max() > 0.02)


def test_buttons_and_sliders_of_the_bar(player: Player) -> None:
    player.button("Next frame")
    player.wait("e.frame === 1")
    player.button("Previous frame")
    player.wait("e.frame === 0")
    player.button("Previous frame")  # the sequence loops
    player.wait("e.frame === 5")
    player.button("Play")
    assert value(player, "e.playing")
    player.button("Pause")
    assert not value(player, "e.playing")
    scrubber = player.page.get_by_role("slider", name="Frame")
    scrubber.fill("4")
    player.wait("e.frame === 4")
    assert scrubber.get_attribute("aria-valuetext") == "frame 5 of 6"
    player.page.get_by_label("Speed").select_option("0.5")
    assert value(player, "e.speed") == 0.5
    player.button("Loop")
    assert not value(player, "e.loop")


def test_scrubbing_while_playing_goes_on_playing(player: Player) -> None:
    player.run("e.speed = 0.1; e.play()")
    box = player.box("role=slider[name='Frame']")
    player.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + box["height"] / 2)
    player.page.mouse.down()
    player.wait("!e.playing")
    player.page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2)
    player.page.mouse.up()
    player.wait("e.playing")


def test_keys(player: Player) -> None:
    """In the full page they work before a click."""
    press = player.page.keyboard.press
    assert value(player, "document.activeElement === document.body")
    steps = [
        ("ArrowRight", "e.frame === 1"), ("ArrowLeft", "e.frame === 0"),
        ("End", "e.frame === 5"), ("Home", "e.frame === 0"),
        (" ", "e.playing"), (" ", "!e.playing"), ("l", "!e.loop"), (">", "e.speed === 1.5"), ("<", "e.speed === 1"),
        ("w", "e.wireframe"), ("e", "!e.effects"), ("p", "e.spread === 1"), ("p", "e.spread === 0"),
        ("2", "!e.layers[1]"), ("2", "e.layers[1]"), ("s", "e.overlays.statistics"), ("m", "!e.player.sound.muted"),
        ("c", "e.comparison.index === 0"), ("Escape", "e.comparison.index === null"),
    ]  # fmt: skip
    for key, condition in steps:
        press(key)
        player.wait(condition)


def test_focus_given_to_the_element_is_its_pictures(new_player: NewPlayer, rich: Path) -> None:
    """And a key acts once, also after another asset was loaded."""
    player = new_player({"asset": rich})
    page_of_yours(player, '<facefolds-player src="asset/" style="height: 300px"></facefolds-player>')
    player.wait("e.ready")
    player.page.keyboard.press("ArrowRight")  # the page's own
    player.run("const p = e.player; e.setAttribute('src', './asset/'); e.focus(); return p === e.player")
    player.wait("e.level === 'full'")
    player.run("e.focus()")
    assert value(player, "[e.frame, e.shadowRoot.activeElement.localName]") == [0, "canvas"]
    player.page.keyboard.press("ArrowRight")
    player.wait("e.frame === 1")


def test_keys_turn_and_zoom(player: Player) -> None:
    player.page.locator("canvas").focus()
    before = value(player, "e.player.view.get()")
    for key in ("Shift+ArrowRight", "Shift+ArrowUp", "-"):
        player.page.keyboard.press(key)
    after = value(player, "e.player.view.get()")
    assert after["azimuth"] == pytest.approx(before["azimuth"] + 5)
    assert after["elevation"] == pytest.approx(before["elevation"] + 5)
    assert after["distance"] == pytest.approx(1.1 * before["distance"])
    player.page.keyboard.press("0")
    again = value(player, "e.player.view.get()")
    assert [again["azimuth"], again["distance"]] == pytest.approx([before["azimuth"], before["distance"]])


def test_orbit_pan_and_zoom_by_pointer(player: Player) -> None:
    drag(player, (400, 300), (80, 30))
    player.wait("Math.abs(e.player.view.get().azimuth) > 5")
    drag(player, (400, 300), (80, 30), "right")
    player.wait("Math.hypot(...e.player.view.get().target) > 0.01")
    before = value(player, "e.player.view.get().distance")
    player.page.mouse.wheel(0, -300)
    player.wait(f"e.player.view.get().distance < {before}")


def test_touch_turns(show: Show) -> None:
    player = show(viewport={"width": 390, "height": 700}, has_touch=True, is_mobile=True)
    swipe(player, [(x, 250) for x in (200, 180, 150, 120)])
    player.wait("e.player.view.get().azimuth > 5")
    before = value(player, "e.player.view.get().distance")
    swipe(player, *([(side(x), 250) for x in (150, 140, 120, 90)] for side in (int, lambda x: 400 - x)))
    player.wait(f"e.player.view.get().distance < {before}")


def test_layers_apart_wireframe_and_reflection(player: Player) -> None:
    page = player.page
    player.button("Settings")
    assert changes_picture(player, lambda: page.get_by_role("button", name="Layer 1").click())
    assert value(player, "e.layers") == [False, True, True]
    page.get_by_role("button", name="All").click()
    assert value(player, "e.layers") == [True, True, True]
    page.get_by_role("button", name="All").click()
    assert value(player, "e.layers") == [False, False, False]
    page.get_by_role("button", name="All").click()
    assert changes_picture(player, lambda: page.get_by_label("Pull apart").fill("0.5"))
    assert changes_picture(player, lambda: page.get_by_role("switch", name="Wireframe").click())
    assert changes_picture(player, lambda: page.get_by_role("switch", name="Reflection").click())
    assert value(player, "[e.spread, e.wireframe, e.effects]") == [0.5, True, False]


def test_background_detail_and_statistics(player: Player, rich: Path) -> None:
    page = player.page
    player.button("Settings")
    page.get_by_role("button", name="White").click()
    assert value(player, "e.background") == "#ffffff"
    assert player.capture()[0, 0].tolist() == [1, 1, 1, 1]
    page.get_by_label("Other background colour").fill("#204060")
    assert np.allclose(player.capture()[0, 0] * 255, [0x20, 0x40, 0x60, 255])
    page.get_by_label("Detail").select_option("coarse")
    player.wait("e.level === 'coarse' && e.layers.length === 2")
    page.get_by_role("switch", name="Statistics").click()
    text = page.locator(".stats").inner_text()
    for word in ("Pictures a second", "Triangles", "Loaded", "GPU memory, computed", "WebCodecs"):
        assert word in text
    statistics = value(player, "e.statistics")
    coarse = read_asset(rich).levels[0]
    assert statistics["triangles"] == sum(len(layer.faces) for layer in coarse.layers)
    width, height = statistics["texture"]
    assert statistics["gpuBytes"] > 4 * width * height


def test_comparison_with_held_out_photos(player: Player) -> None:
    page = player.page
    player.button("Compare with a photo")
    player.wait("e.comparison.index === 0 && e.frame === 2 && e.player.view.exact")
    page.get_by_label("Border between").fill("20")
    page.get_by_label("Photo", exact=True).select_option("1")
    player.wait("e.comparison.index === 1 && e.frame === 4")
    stage, photo = player.box("canvas"), player.box(".compare img")
    assert photo["width"] == pytest.approx(photo["height"])  # the photo is square
    assert photo["height"] == pytest.approx(min(stage["width"], stage["height"]), abs=1)
    player.button("Close the comparison")
    assert value(player, "e.comparison.index") is None
    assert not value(player, "e.player.view.exact")


def test_full_screen(player: Player) -> None:
    player.button("Full screen")
    player.page.wait_for_function("document.fullscreenElement !== null")
    player.page.keyboard.press("f")
    player.page.wait_for_function("document.fullscreenElement === null")


def test_the_shared_link_shows_the_same(player: Player) -> None:
    player.run(
        """e.spread = 0.2; e.player.view.set({azimuth: 25, elevation: 8, distance: 0.8, target: [0, 0.02, 0]});
        e.background = '#104020'; e.layers = [true, false, true]; e.effects = false; e.speed = 0.5;
        await e.seek(3);"""
    )
    before = player.capture()
    player.button("Copy a link")
    assert "copied" in player.notice()
    link = player.page.evaluate("navigator.clipboard.readText()")
    player.page.goto("about:blank")
    player.page.goto(link)
    player.wait("e.ready && e.level === 'full' && e.frame === 3")
    assert value(player, "e.speed") == 0.5
    assert np.abs(player.capture() - before).max() <= 2 / 255


def test_every_control_has_a_name_and_can_be_reached(player: Player) -> None:
    player.button("Settings")
    unnamed = player.run(
        """const controls = [...e.shadowRoot.querySelectorAll('button, input, select, canvas, [role]')];
        const name = (x) => x.getAttribute('aria-label') || x.closest('label')?.innerText || x.innerText || x.title;
        return controls.filter((x) => x.checkVisibility() && !name(x)?.trim()).map((x) => x.outerHTML);"""
    )
    assert unnamed == []
    player.page.locator("canvas").focus()
    for _ in range(12):
        player.page.keyboard.press("Tab")
    assert value(player, "e.shadowRoot.activeElement !== null")
