"""What a page puts into the element: hotspots that follow the face, a poster and a bar of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.geometry.sphere_uv import uv_to_st
from tests.assets import MOVING, TRACK, make_asset
from tests.scenes import look_at_origin, view_of
from tests.viewer.conftest import NewPlayer, Player, element, page_of_yours

BARE = 'controls="none"'
PLACE = (0.12, -0.1)
"""u, v."""
SPOT = """const [box, own] = [document.querySelector('#spot').getBoundingClientRect(), e.getBoundingClientRect()];
    return [box.x + box.width / 2 - own.x, box.y + box.height / 2 - own.y];"""
HOTSPOT = (
    f'<button slot="hotspot-a" id="spot" data-surface="{PLACE[0]} {PLACE[1]} 1" style="width: 4px; height: 4px; '
    'padding: 0; border: 0"></button>'
)


def point_of(asset: Path) -> np.ndarray:
    """Where the innermost layer has the place: the vertex nearest to it (the mesh is fine enough for two pixels)."""
    level = read_asset(asset).full
    mesh = level.layers[-1]
    away = np.linalg.norm(mesh.st - uv_to_st(np.array(PLACE), level.windows[-1]), axis=1)
    near = np.argsort(away)[:4]
    weights = 1 / np.maximum(away[near], 1e-6)
    return np.asarray((weights[:, None] * mesh.vertices[near]).sum(0) / weights.sum())


def place_of(player: Player, point: np.ndarray) -> object:
    """Where the element shows a point of the room, CSS pixels."""
    return player.run(
        """const { view, projection } = e.player.view.matrices(...e.player.size, e.player.renderer.bounds());
        const times = (m, p) => [0, 1, 2, 3].map((i) => p.reduce((sum, x, k) => sum + m[4 * k + i] * x, 0));
        const [x, y, , w] = times(projection, times(view, v));
        return [(0.5 + x / w / 2) * e.clientWidth, (0.5 - y / w / 2) * e.clientHeight];""",
        [*map(float, point), 1.0],
    )


def test_a_hotspot_stands_at_its_place_from_every_side(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, BARE, HOTSPOT)
    point = point_of(rich)
    for azimuth in (0, 25, -30):
        player.run("e.state = {view: {azimuth: v}}; await new Promise((r) => setTimeout(r, 200))", azimuth)
        assert player.run(SPOT) == pytest.approx(place_of(player, point), abs=3), azimuth
        assert player.run("return document.querySelector('#spot').hasAttribute('data-visible')")


def test_a_hotspot_follows_a_head_that_moves(new_player: NewPlayer, tmp_path: Path) -> None:
    """From frame to frame, as it plays, and back to rest where the head is held still."""
    asset = make_asset(tmp_path / "asset", layers=3, frames=3, resolution=64, source=MOVING).folder
    player = element(new_player, asset, f'{BARE} loop="false"', HOTSPOT)
    point = point_of(asset)
    places = [place_of(player, TRACK.at(frame).apply(point)) for frame in range(3)]
    for frame in (0, 2, 1):
        assert player.run("return await e.seek(v)", frame)
        assert player.run(SPOT) == pytest.approx(places[frame], abs=3), frame
    player.run("e.play()")
    player.wait("e.frame === 2 && !e.playing")
    assert player.run(SPOT) == pytest.approx(places[2], abs=3)
    player.run("e.still = true; await new Promise(requestAnimationFrame); await new Promise(requestAnimationFrame)")
    assert player.run(SPOT) == pytest.approx(place_of(player, point), abs=3)
    assert np.abs(np.subtract(places[2], places[0])).max() > 10  # the motion is large enough to be seen in this test


def test_a_place_that_is_turned_away_says_so(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, BARE, HOTSPOT)
    code = "e.setCamera(v); await new Promise((r) => setTimeout(r, 200)); return document.querySelector('#spot')"
    for azimuth, visible in ((0, True), (180, False)):
        camera = view_of(look_at_origin("camera", azimuth, 0, 64))
        assert player.run(f"{code}.hasAttribute('data-visible')", camera) is visible, azimuth


def test_the_surface_under_a_point_gives_a_hotspot_there(new_player: NewPlayer, rich: Path) -> None:
    player = element(new_player, rich, BARE, HOTSPOT)
    surface = player.run("const { x, y } = e.getBoundingClientRect(); return e.surfaceFromPoint(x + 210, y + 130)")
    assert isinstance(surface, str) and len(surface.split()) == 3
    moved = "document.querySelector('#spot').dataset.surface = v; await new Promise((r) => setTimeout(r, 200))"
    player.run(moved, surface)
    assert player.run(SPOT) == pytest.approx([210, 130], abs=1)
    assert player.run("return e.surfaceFromPoint(1, 1)") is None


def test_a_poster_and_a_bar_of_the_page_go_when_there_is_a_picture(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich}, viewport={"width": 400, "height": 300})
    release = player.hold("**/manifest.json")
    inner = '<p slot="poster" id="poster">Wait</p><p slot="progress-bar" id="bar">Coming</p>'
    page_of_yours(player, f'<facefolds-player src="asset/" style="height: 300px">{inner}</facefolds-player>')
    bar, poster = player.page.locator("#bar"), player.page.locator("#poster")
    bar.wait_for(state="visible")
    assert poster.is_visible()
    assert not player.run("return e.shadowRoot.querySelector('.spinner').checkVisibility()")
    release()
    player.wait("e.ready")
    assert not bar.is_visible()
    player.page.wait_for_function("() => getComputedStyle(document.querySelector('#poster')).opacity === '0'")
