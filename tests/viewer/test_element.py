"""The player as an element among others: what it takes of the page, what it gives back, what it keeps."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from tests.viewer.conftest import NewPlayer, Player, Show, page_of_yours, swipe

COUNT_FRAMES = """window.frames_asked = 0; const ask = requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (act) => { ++window.frames_asked; return ask(act); };"""
TALL = '<div style="height:3000px"></div>'
ONE = '<facefolds-player src="asset/" style="height:300px" {0}></facefolds-player>'
SMALL = ONE.replace("height:300px", "width:24px; height:300px").format('controls="none"')


ALL_READY = "[...document.querySelectorAll('facefolds-player')].every((e) => e.ready)"


def names(player: Player) -> list[str]:
    return [Path(urlsplit(url).path).name for url in player.requests]


Opened = Callable[..., Player]


@pytest.fixture
def opened(new_player: NewPlayer, rich: Path) -> Opened:
    """A page of yours with `rich`, where a condition on its (first) element holds."""

    def of(body: str, until: str = "e.ready", **options: object) -> Player:
        player = new_player({"asset": rich}, **options)
        page_of_yours(player, body)
        player.page.locator("facefolds-player").first.wait_for(state="attached")
        player.wait(until)
        return player

    return of


@pytest.mark.parametrize(
    ("colour", "seen"),
    [
        pytest.param("#fff", (255, 255, 255, 255), marks=pytest.mark.nightly),
        pytest.param("rebeccapurple", (0x66, 0x33, 0x99, 255), marks=pytest.mark.nightly),
        ("rgb(0 200 100 / 50%)", (0, 100, 50, 128)),  # premultiplied
        ("var(--mine)", (1, 2, 3, 255)),
    ],
)
def test_any_colour_of_css_is_a_background(opened: Opened, colour: str, seen: tuple[int, ...]) -> None:
    """What is none is refused and changes nothing."""
    player = opened(f'<style>:root {{ --mine: rgb(1 2 3) }}</style>{ONE.format(f"""background="{colour}" """)}')
    assert np.abs(player.capture()[0, 0] * 255 - seen).max() <= 1
    refused = player.run("try { e.background = 'nonsense' } catch (error) { return [error.name, e.background] }")
    assert refused == ["TypeError", colour]


@pytest.mark.parametrize("until", ["true", "e.ready"])
def test_a_part_of_the_state_changes_that_part(opened: Opened, until: str) -> None:
    player = opened(ONE.format('controls="none"'), until)
    player.run("e.state = {view: {azimuth: 40}}; e.state = {view: {elevation: 5}}")
    player.wait("e.ready")
    view, home = player.run("return [e.state.view, e.player.view.home]")
    assert [view["azimuth"], view["elevation"]] == [40, 5]
    assert [view["distance"], view["target"]] == [pytest.approx(home["distance"]), pytest.approx(home["target"])]
    before = player.run("return e.background")
    for wrong in ("view: {azimuth: 'x'}", "mode: 'nonsense'"):
        tried = f"try {{ e.state = {{background: '#123456', {wrong}}} }} catch (error) {{ return error.name }}"
        assert player.run(tried) == "TypeError"
    assert player.run("return e.background") == before


def test_the_wheel_scrolls_the_page_until_the_player_is_meant(opened: Opened) -> None:
    player = opened(ONE.format("") + TALL)
    before = player.run("return e.player.view.goal.distance")
    mouse = player.page.mouse
    mouse.move(200, 100)
    mouse.wheel(0, 60)
    player.page.wait_for_function("() => scrollY > 0")
    assert player.run("return e.player.view.goal.distance") == before
    player.page.evaluate("() => scrollTo(0, 0)")
    player.page.keyboard.down("Control")
    mouse.wheel(0, -60)
    player.page.keyboard.up("Control")
    player.wait(f"e.player.view.goal.distance < {before}")
    player.run("e.player.view.reset()")
    mouse.click(200, 100)  # now it has the focus
    mouse.wheel(0, -60)
    player.wait(f"e.player.view.goal.distance < {before}")
    assert player.page.evaluate("() => scrollY") == 0


def test_one_finger_scrolls_the_page_upright_and_turns_across(opened: Opened) -> None:
    phone = {"viewport": {"width": 390, "height": 600}, "has_touch": True, "is_mobile": True}
    player = opened(ONE.format("") + TALL, **phone)
    assert player.run("return getComputedStyle(e.shadowRoot.querySelector('canvas')).touchAction") == "pan-y"
    swipe(player, [(200, 200 - 10 * k) for k in range(13)])
    player.page.wait_for_function("() => scrollY > 50")
    assert player.run("return [e.player.view.goal.azimuth, e.player.view.goal.elevation]") == [0, 0]
    player.page.wait_for_timeout(1000)  # the page has come to rest
    player.page.evaluate("() => scrollTo(0, 0)")
    swipe(player, [(200 - 10 * k, 150) for k in range(9)])
    player.wait("e.player.view.goal.azimuth > 5")
    assert player.page.evaluate("() => scrollY") == 0


def test_twenty_players_share_one_context_and_give_it_back(opened: Opened) -> None:
    player = opened(20 * ONE.format('controls="none"'), ALL_READY, viewport={"width": 400, "height": 6000})
    all_of_them = "const all = [...document.querySelectorAll('facefolds-player')];"
    assert player.run(
        f"""{all_of_them} const count = new Set(all.map((e) => e.player.renderer.graphics.gl)).size;
        const middle = all.map(({{ player: {{ canvas }} }}) => [...canvas.getContext('2d').getImageData(
          canvas.width / 2, canvas.height / 2, 1, 1).data].join());
        return [count, all.some((e) => e.player.lost), middle.every((pixel) => pixel !== '22,24,29,255')];"""
    ) == [1, False, True]
    assert player.run(
        f"""{all_of_them} const {{ gl }} = all[0].player.renderer.graphics; const before = gl.isContextLost();
        for (const one of all) one.remove(); await 0; return [before, gl.isContextLost()];"""
    ) == [False, True]


def test_nothing_moves_at_rest(opened: Opened) -> None:
    player = opened(ONE.format(""), "e.level === 'full'", script=COUNT_FRAMES)
    player.page.wait_for_timeout(300)
    rest = "const n = frames_asked; await new Promise((done) => setTimeout(done, 500)); return frames_asked - n"
    assert player.run(rest) == 0
    player.run("e.play()")
    player.wait("frames_asked > 5")


def test_off_the_screen_nothing_is_drawn_decoded_or_fetched(opened: Opened) -> None:
    player = opened(TALL + ONE.format(""), script=COUNT_FRAMES)
    player.run("e.play()")
    player.page.wait_for_timeout(600)
    assert "coarse.mp4" in names(player)
    assert "full.mp4" not in names(player)
    rest = """const n = [frames_asked, e.frame, e.player.drawn.length];
        await new Promise((done) => setTimeout(done, 500));
        return [frames_asked - n[0], e.frame - n[1], e.playing];"""
    assert player.run(rest) == [0, 0, True]
    player.page.evaluate("() => scrollTo(0, 3000)")
    player.wait("e.level === 'full' && e.frame > 0")
    player.page.evaluate("() => scrollTo(0, 0)")
    player.wait("!e.player.onScreen")
    assert player.run(rest) == [0, 0, True]


def test_a_lazy_player_waits_until_it_is_near(opened: Opened) -> None:
    player = opened(TALL + ONE.format('loading="lazy"'), "true")
    player.page.wait_for_timeout(500)
    assert "manifest.json" not in names(player)
    player.page.evaluate("() => scrollTo(0, 3000)")
    player.wait("e.ready")


def test_the_level_can_be_changed_at_any_time(opened: Opened) -> None:
    player = opened(ONE.format('level="coarse"'))
    assert player.run("return e.level") == "coarse"
    player.run("e.setAttribute('level', 'full')")
    player.wait("e.level === 'full'")
    player.run("e.level = 'coarse'")
    player.wait("e.level === 'coarse'")
    player.run("e.removeAttribute('level')")
    player.wait("e.level === 'full' && e.player.detail.auto")


@pytest.mark.parametrize("how", ["e.style.width = '300px'", "e.player.view.zoom(0.1)", "e.level = 'full'"])
def test_a_small_canvas_needs_no_fine_level(opened: Opened, how: str) -> None:
    """In pixels of the device: a texel for a pixel is enough. A larger canvas, or a nearer view, needs more."""
    player = opened(SMALL)
    player.page.wait_for_timeout(500)
    assert player.run("return [e.level, e.player.detail.auto]") == ["coarse", True]
    assert "full.mp4" not in names(player)
    player.run(how)
    player.wait("e.level === 'full'")


def test_a_dense_screen_needs_a_fine_level(opened: Opened) -> None:
    opened(SMALL, "e.level === 'full'", device_scale_factor=2)


def test_what_it_shows_is_kept_when_it_is_moved(opened: Opened) -> None:
    player = opened(ONE.format("") + '<div id="other"></div>', "e.level === 'full'")
    player.run("e.spread = 0.5; await e.seek(3); e.player.view.set({azimuth: 30, elevation: 5, distance: 2, "
               "target: [0, 0, 0]})")  # fmt: skip
    count = len(names(player))
    moved = "const b = e.player; document.querySelector('#other').append(e); await 0; return [e.player === b, e.frame]"
    assert player.run(moved) == [True, 3]
    assert len(names(player)) == count  # nothing was loaded again
    player.run("const other = e.parentElement; e.remove(); await 0; other.append(e)")
    player.wait("e.ready && e.frame === 3")
    view = player.run("return e.player.view.get()")
    assert view["azimuth"] == pytest.approx(30)
    assert player.run("return e.spread") == 0.5


def test_auto_steps_down_where_pictures_are_late_and_up_again(opened: Opened) -> None:
    player = opened(ONE.format(""), "e.level === 'full'")
    player.run(
        """window.slow = true; e.addEventListener('frame', () => {
          for (const end = performance.now() + 120; slow && e.level === 'full' && performance.now() < end;); });
        e.speed = 0.5; e.play();"""
    )
    player.wait("e.level === 'coarse'")
    player.run("slow = false; e.player.detail.adaptation.wait = 0.5")
    player.wait("e.level === 'full'")


def test_many_sizes_do_not_disturb_each_other(opened: Opened) -> None:
    """The shared canvas is as large as the largest: a small player copies its own part."""
    small = '<facefolds-player src="asset/" controls="none" style="width:120px; height:150px"></facefolds-player>'
    player = opened(small + ONE.format('controls="none"'), ALL_READY)
    difference = player.run(
        """e.pause(); await e.seek(2); const { canvas } = e.player; const seen = e.capture().data;
        const there = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
        return Math.max(...there.map((value, i) => Math.abs(value - seen[i])));"""
    )
    assert isinstance(difference, int | float)
    assert difference <= 1


def test_a_folder_without_an_address_plays(show: Show, rich: Path, tmp_path: Path) -> None:
    """A ZIP that is dropped on the page."""
    archive = Path(shutil.make_archive(str(tmp_path / "asset"), "zip", rich.parent, rich.name))
    player = show(full=True)
    code = """const bytes = Uint8Array.from(atob(v), (sign) => sign.charCodeAt(0)); const transfer = new DataTransfer();
        transfer.items.add(new File([bytes], 'asset.zip')); window.before = e.player;
        dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, cancelable: true, bubbles: true }));"""
    player.requests.clear()
    player.run(code, base64.b64encode(archive.read_bytes()).decode())
    player.wait("e.player !== before && e.level === 'full'")
    assert "full.mp4" not in names(player)
    transfer = "const t = new DataTransfer(); t.items.add(new File(['x'], 'x.txt'));"
    player.run(transfer + "dispatchEvent(new DragEvent('drop', { dataTransfer: t, cancelable: true }));")
    assert "no manifest.json" in player.notice()
