"""Backdrops and the shadow on the floor: what is behind the layers, in the picture, in captures and where it fades."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.viewer.conftest import NewPlayer, Player, element

WIDTH, HEIGHT = 320, 240
INNER, OUTER = np.array([0x4A, 0x50, 0x5E]), np.array([0x0E, 0x10, 0x14])
"""Of `studio` (viewer/src/colours.js)."""


@pytest.fixture
def player(new_player: NewPlayer, rich: Path) -> Player:
    return element(new_player, rich, 'controls="none"', size=(WIDTH, HEIGHT))


def studio() -> NDArray[np.float64]:
    """(H, W, 3): from the middle of the picture, somewhat raised, to its farthest corner."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    part = np.hypot(x - 0.5 * WIDTH, y - 0.45 * HEIGHT) / np.hypot(0.5 * WIDTH, 0.55 * HEIGHT)
    return (INNER + part[..., None] * (OUTER - INNER)) / 255


def drawn(player: Player, background: str, shadow: float) -> NDArray[np.float64]:
    """(H, W, 4) premultiplied, in [0, 1]."""
    player.run("e.background = v[0]; e.setAttribute('shadow-intensity', v[1])", [background, shadow])
    return player.capture()


def test_a_backdrop_is_behind_the_layers(player: Player) -> None:
    bare, over = drawn(player, "transparent", 0), drawn(player, "studio", 0)
    expected = bare[..., :3] + (1 - bare[..., 3:]) * studio()
    assert (bare[..., 3] > 0.9).any() and (bare[..., 3] == 0).any()
    assert np.abs(over[..., :3] - expected).max() < 2.5 / 255  # rounded once for each layer
    assert (over[..., 3] == 1).all()


def test_where_the_picture_fades_the_backdrop_stays(player: Player) -> None:
    drawn(player, "studio", 0)
    corners = player.run(
        """const { player } = e;
        const { projection, view } = player.view.matrices(...player.size, player.renderer.bounds());
        return [1, 0.06].map((strength) => {
          player.renderer.draw(projection, view, strength);
          const one = new OffscreenCanvas(1, 1).getContext('2d');
          one.drawImage(player.canvas, 3, 3, 1, 1, 0, 0, 1, 1);
          return [...one.getImageData(0, 0, 1, 1).data]; });"""
    )
    assert np.abs(np.subtract(*corners)).max() <= 2
    assert np.abs(corners[0][:3] - 255 * studio()[3, 3]).max() <= 2


def test_the_shadow_lies_below_and_is_seen_from_above_only(player: Player) -> None:
    turn = "e.state = { view: { elevation: v } }; await new Promise(requestAnimationFrame)"
    found = {}
    for elevation in (20, -20):
        player.run(turn, elevation)
        found[elevation] = drawn(player, "transparent", 1)[..., 3] - drawn(player, "transparent", 0)[..., 3]
    assert found[20].max() > 0.3
    rows = np.flatnonzero(found[20].max(1) > 0.02)
    assert rows.min() > HEIGHT / 2
    assert not found[-20].any()


def test_a_backdrop_brings_its_shadow_and_a_colour_none(player: Player) -> None:
    seen = "return e.player.renderer.shadow"
    assert player.run(f"e.background = 'clay'; {seen}") == pytest.approx(0.55)
    assert player.run(f"e.background = 'white'; {seen}") == 0
    assert player.run(f"e.setAttribute('shadow-intensity', '7'); {seen}") == 1
    words = player.run("try { e.background = 'stage' } catch (error) { return error.message }")
    assert "studio, daylight, clay" in words and '"stage"' in words
