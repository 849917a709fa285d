"""The middle of what was filmed bounds the view, softly; the head stands above the bar at every size; reset, sway."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.assets import PLAIN, SOURCE, cap_mesh, cap_texture, write_asset, write_store
from tests.scenes import look_at_origin, view_of
from tests.viewer.conftest import Player, Show
from tests.viewer.fixtures import change_manifest

FILMED = {"azimuth": [-30, 40], "elevation": [-10, 20]}
GOOD = {"azimuth": (-23, 33), "elevation": (-7, 17)}
"""The middle four fifths."""


@pytest.fixture
def player(show: Show, rich_copy: Path) -> Player:
    change_manifest(rich_copy, lambda value: value.update(view=FILMED))
    return show(full=True, asset=rich_copy, viewport={"width": 760, "height": 500})


def test_a_drag_beyond_what_is_good_meets_resistance_fades_and_comes_back(player: Player) -> None:
    mouse = player.page.mouse
    mouse.move(600, 200)
    mouse.down()
    mouse.move(100, 200, steps=10)  # far more than the range
    player.wait("e.player.view.strength < 0.4")
    toast = "e.shadowRoot.querySelector('.toast')"
    said = f"return {toast}.hidden ? '' : {toast}.textContent"
    assert player.run(said) == "Cameras saw too little from further round"
    assert player.run("return e.player.view.get().azimuth < 70")
    pixel = "[...e.shadowRoot.querySelector('canvas').getContext('2d').getImageData(380, 200, 1, 1).data]"
    player.wait(f"{pixel}.slice(0, 3).every((value, i) => Math.abs(value - [0x16, 0x18, 0x1d][i]) < 80)")
    assert player.run(said)  # as long as it is held
    mouse.up()
    player.wait(f"{toast}.hidden")
    player.wait(f"e.player.view.strength === 1 && e.player.view.get().azimuth < {GOOD['azimuth'][1] + 0.1}")


@pytest.mark.parametrize("good", [None, {"azimuth": [-29, 43], "elevation": [-4, 12]}], ids=["filmed", "measured"])
def test_a_link_beyond_what_is_good_shows_the_nearest_that_is(show: Show, rich_copy: Path, good: dict | None) -> None:
    change_manifest(rich_copy, lambda value: value.update(view=FILMED | ({"good": good} if good else {})))
    player, bounds = show(asset=rich_copy), good or GOOD
    for azimuth, end in ((170, 1), (-80, 0)):
        view = player.run("e.state = { view: { azimuth: v, elevation: 60 } }; return e.player.view.get()", azimuth)
        assert [view["azimuth"], view["elevation"]] == pytest.approx([bounds["azimuth"][end], bounds["elevation"][1]])


def opaque_all_round(folder: Path) -> Path:
    """One opaque layer that goes 171 degrees to each side."""
    window = (-0.5, 0.5, -0.95, 0.95)
    texture = cap_texture(0, 0, 32)
    texture[..., 3] = 255
    store = write_store(folder.with_name("textures"), texture[None, None])
    write_asset(folder, [cap_mesh(0.4, 40, window)], [window], store, SOURCE, PLAIN)
    change_manifest(folder, lambda value: value.update(view={**FILMED, "good": FILMED}))
    return folder


def dissolved(player: Player, azimuth: float, elevation: float) -> np.ndarray:
    """(H, W) opacity that is missing from there, beside the same view without any limit."""
    set_view = "const { view } = e.player; for (const orbit of [view.now, view.goal]) Object.assign(orbit, v)"
    player.run(set_view, {"azimuth": azimuth, "elevation": elevation})
    limited = player.capture()[..., 3]
    player.run("e.player.view.setFilmed(null)")
    whole = player.capture()[..., 3]
    player.run("e.player.view.setFilmed(v)", {**FILMED, "good": FILMED})
    return whole - limited


def test_hems_fade_beyond_what_is_good_and_nothing_does_within(show: Show, tmp_path: Path) -> None:
    """Too far round, the far side (right) dissolves and the near one stays; from above the back does, not the front."""
    player = show(asset=opaque_all_round(tmp_path / "asset"), viewport={"width": 400, "height": 300})
    player.run("e.background = 'transparent'")
    for azimuth, elevation in ((-30, 0), (40, 0), (0, 20), (0, -10)):
        assert np.abs(dissolved(player, azimuth, elevation)).max() == 0, (azimuth, elevation)
    beside = dissolved(player, 44.5, 0)
    assert beside.min() == 0 and beside[:, 200:].max() > 0.5 and beside[:, :200].max() == 0
    above = dissolved(player, 0, 60)
    assert above.min() == 0 and above[:150].max() > 0.5 and above[150:].max() == 0


def test_layers_that_are_pulled_apart_can_be_seen_from_the_side(player: Player) -> None:
    player.page.locator("canvas").focus()
    player.page.keyboard.press("p")
    player.wait("e.player.view.get().azimuth > 41 && e.player.view.strength === 1")
    player.page.keyboard.press("p")
    player.wait("Math.abs(e.player.view.get().azimuth) < 1")


def test_zoom_ends_where_detail_ends(player: Player) -> None:
    """By the wheel and in links: at six pixels a texel, or twice as near as the first view."""
    player.page.locator("canvas").click(position={"x": 300, "y": 200})
    for _ in range(12):
        player.page.mouse.wheel(0, -400)
    closest = """const { view } = e.player; const focal = view.pixelsAUnit * view.goal.distance;
        return Math.min(view.front + focal / (6 * view.detail), view.home.distance / 2);"""
    assert player.run("return e.player.view.goal.distance") == pytest.approx(player.run(closest))
    nearest = player.run("return e.player.view.goal.distance")
    player.run("e.state = { view: { distance: 0.01 } }")
    assert player.run("return e.player.view.get().distance") == pytest.approx(nearest)


def test_the_head_stays_in_sight_however_far_one_zooms_out(player: Player) -> None:
    player.page.locator("canvas").click(position={"x": 300, "y": 200})
    for _ in range(12):
        player.page.mouse.wheel(0, 400)
    assert player.run("const { view } = e.player; return view.goal.distance / view.whole") == pytest.approx(3)


def test_an_exact_camera_is_never_bounded(player: Player) -> None:
    player.run("e.setCamera(v)", view_of(look_at_origin("behind", 180, 0, 64)))
    assert player.run("return e.player.view.strength") == 1


def lowest_and_highest(player: Player) -> tuple[float, float]:
    """Rows of the picture that show anything, CSS pixels."""
    player.run("e.background = '#00ff00'; await new Promise(requestAnimationFrame)")
    shown = player.capture()[..., :3]
    rows = np.flatnonzero((np.abs(shown - (0, 1, 0)).max(-1) > 0.1).any(1))
    return float(rows[0]), float(rows[-1])


def test_the_head_stands_above_the_bar_at_every_size(player: Player) -> None:
    for width, height in ((760, 500), (390, 700), (700, 300), (360, 240)):
        player.page.set_viewport_size({"width": width, "height": height})
        player.wait(f"e.player.size[0] === {width} && e.player.size[1] === {height}")
        player.page.wait_for_timeout(100)
        top = player.box(".bar")["y"]
        high, low = lowest_and_highest(player)
        assert 0 < high < low <= top + 1, (width, height)
        assert low - high > 0.3 * min(width, top), (width, height)


def test_the_sheet_of_a_phone_leaves_the_face_in_sight(player: Player) -> None:
    player.page.set_viewport_size({"width": 390, "height": 700})
    player.wait("e.player.size[0] === 390")
    player.button("Settings")
    player.page.locator(".panel").wait_for()
    player.page.wait_for_timeout(200)
    high, low = lowest_and_highest(player)
    assert 0 < high < low <= player.box(".panel")["y"] + 1


def test_a_view_that_somebody_chose_stays_when_the_size_changes(player: Player) -> None:
    player.run("e.player.view.set({azimuth: 20, elevation: 5, distance: 0.8, target: [0, 0, 0]})")
    player.page.set_viewport_size({"width": 400, "height": 640})
    player.wait("e.player.size[0] === 400")
    view = player.run("return e.player.view.get()")
    assert [view["azimuth"], view["distance"]] == pytest.approx([20, 0.8])


def test_reset_brings_everything_back(player: Player) -> None:
    before = player.capture()
    player.run(
        """e.player.view.set({azimuth: 20, elevation: 5, distance: 0.8, target: [0, 0.1, 0]});
        e.background = 'white'; e.spread = 0.3; e.layers = [true, false, true]; e.wireframe = true; e.effects = false;
        e.mode = 'depth'; e.speed = 2; e.loop = false; e.level = 'coarse';"""
    )
    player.wait("e.level === 'coarse'")
    player.page.locator("canvas").focus()
    player.page.keyboard.press("0")
    player.wait("e.level === 'full'")
    assert player.run("return [e.speed, e.loop, e.mode, e.spread, e.wireframe]") == [1, True, "colour", 0, False]
    assert np.abs(player.capture() - before).max() <= 1 / 255


def test_it_sways_until_somebody_touches_it(show: Show) -> None:
    player = show("", viewport={"width": 760, "height": 500})
    player.wait("e.playing && e.player.view.swaying > 0.5")
    player.page.mouse.move(300, 200)
    player.page.mouse.down()
    player.page.mouse.up()
    assert player.run("return e.player.view.swaying") == 0


@pytest.mark.parametrize(("view", "options"), [("view=10,0,1,0,0,0", {}), ("", {"reduced_motion": "reduce"})])
def test_a_chosen_view_and_reduced_motion_do_not_sway(show: Show, view: str, options: dict) -> None:
    """With reduced motion it does not play by itself either."""
    player = show(view, **options)
    player.page.wait_for_timeout(200)
    assert player.run("return e.player.view.swaying") == 0
    assert not options or player.run("return e.playing") is False
