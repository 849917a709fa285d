"""What eyes need: contrast of all words, layers in sight when they are pulled apart, progress that counts all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.viewer.conftest import NewPlayer, Player, Show, page_of_yours

CONTRAST = """
const numbers = (colour) => {
  const [r, g, b, a = 1] = colour.match(/[\\d.]+/g).map(Number);
  return [r, g, b, a];
};
const over = ([r, g, b, a], behind) => [r, g, b].map((v, i) => a * v + (1 - a) * behind[i]);
const light = (rgb) => rgb.map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
  .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const ground = (node) => {
  const chain = [];
  for (let at = node; at instanceof Element; at = at.parentElement) chain.unshift(at);
  return chain.reduce((rgb, at) => over(numbers(getComputedStyle(at).backgroundColor), rgb), v);
};
const found = [];
for (const node of e.shadowRoot.querySelectorAll(
    '.bar *, .panel *, dialog *, .message *, .title')) {
  const words = [...node.childNodes].filter((n) => n.nodeType === 3).map((n) => n.data.trim()).join(' ').trim();
  if (!words || !node.checkVisibility() || node.disabled) continue;
  const [text, behind] = [over(numbers(getComputedStyle(node).color), ground(node)), ground(node)].map(light);
  const ratio = (Math.max(text, behind) + 0.05) / (Math.min(text, behind) + 0.05);
  found.push([words.slice(0, 30), ratio]);
}
return found;
"""


DARK, WHITE = (0, 0, 0), (255, 255, 255)
NEIGHBOURS = (("#16181d", DARK), ("#ffffff", WHITE), ("transparent", WHITE))


@pytest.fixture
def player(show: Show) -> Player:
    return show(full=True, viewport={"width": 900, "height": 700})


@pytest.mark.parametrize(
    ("ground", "behind"),
    [
        ("#16181d", WHITE),
        ("#ffffff", DARK),
        ("#7f7f7f", WHITE),
        ("transparent", DARK),
        *(pytest.param(*cell, marks=pytest.mark.nightly) for cell in NEIGHBOURS),
    ],
)
def test_all_words_have_the_contrast_that_wcag_asks_for(
    player: Player, behind: tuple[int, int, int], ground: str
) -> None:
    """4.5 to 1, whatever the picture or the page's photo behind panels is, in both sets of colours."""
    player.run("e.background = v", ground)
    player.button("Settings")
    player.page.get_by_text("Keys").click()
    found: list[tuple[str, float]] = player.run(CONTRAST, list(behind))
    assert len(found) > 30 and "caps" in dict(found)
    assert [(words, round(ratio, 1)) for words, ratio in found if ratio < 4.5] == []


@pytest.mark.parametrize(
    ("page", "background", "light"),
    [
        ("#fff", "transparent", True),
        ("#fff", "#203040", False),
        ("#111", "transparent", False),
        ("#111", "#ffe", True),
        ("", "transparent", True),
    ],
)
def test_the_controls_have_the_colours_of_what_is_behind(
    new_player: NewPlayer, rich: Path, page: str, background: str, light: bool
) -> None:
    player = new_player({"asset": rich}, viewport={"width": 384, "height": 300})
    body = f'<facefolds-player src="asset/" background="{background}" style="height: 300px"></facefolds-player>'
    style = f"<style>html {{ background: {page} }} facefolds-player {{ --facefolds-accent: rgb(1, 2, 3) }}</style>"
    page_of_yours(player, style + body)
    player.wait("e.ready")
    words = "return getComputedStyle(e.shadowRoot.querySelector('.title')).color.match(/\\d+/g).map(Number)"
    assert (max(player.run(words)) < 100) is light
    assert 300 - player.box(".bar")["y"] < 45  # of 300 pixels
    track = "return getComputedStyle(e.shadowRoot.querySelector('[data-do=settings]')).accentColor"
    assert player.run(track) == "rgb(1, 2, 3)"
    player.run("document.documentElement.style.colorScheme = 'light dark'")
    player.page.emulate_media(color_scheme="dark")
    changed = False if not page else light  # where nothing is painted behind, the browser's own ground is dark now
    player.wait(f"e.shadowRoot.querySelector('.stage').classList.contains('light') === {str(changed).lower()}")


@pytest.mark.parametrize(
    ("size", "how"),
    [
        ((900, 700), "settings"),
        ((390, 700), "property"),
        ((390, 700), "before it is there"),
        pytest.param((900, 700), "property", marks=pytest.mark.nightly),
        pytest.param((900, 700), "before it is there", marks=pytest.mark.nightly),
        pytest.param((390, 700), "settings", marks=pytest.mark.nightly),
    ],
)
def test_layers_that_are_pulled_apart_are_seen_from_aside_and_fill_the_canvas(
    new_player: NewPlayer, rich: Path, how: str, size: tuple[int, int]
) -> None:
    player = new_player({"asset": rich}, viewport={"width": size[0], "height": size[1]})
    if how == "before it is there":
        page_of_yours(player, '<facefolds-player src="asset/" style="height:100vh" controls="none"></facefolds-player>')
        player.run("await customElements.whenDefined('facefolds-player'); e.spread = 1")
        player.wait("e.level === 'full'")
    else:
        player.open("asset", full=True)
        player.run("e.setAttribute('controls', 'none'); e.spread = 0.9")
        if how == "settings":
            player.run("e.setAttribute('controls', '')")
            player.button("Settings")
            player.page.get_by_label("Pull apart").fill("1")
            player.button("Close the settings")
        else:
            player.run("e.spread = 1")
    aside = 62 if size[0] > size[1] else 28
    player.wait(f"Math.abs(e.player.view.get().azimuth - {aside}) < 0.01")
    player.page.wait_for_timeout(500)
    corners = """const { view, renderer, size } = e.player; const { low, high } = renderer.bounds();
        const { projection: p, view: m } = view.matrices(...size, renderer.bounds());
        const times = (a, x) => [0, 1, 2, 3].map((i) => x.reduce((sum, v, k) => sum + a[4 * k + i] * v, 0));
        const [width, height] = [size[0], size[1] - view.inset];
        return [0, 1, 2, 3, 4, 5, 6, 7].map((k) => {
          const at = [0, 1, 2].map((i) => (k >> i & 1 ? high[i] : low[i]));
          const clip = times(p, times(m, [...at, 1]));
          return [(clip[0] / clip[3] + 1) / 2, (1 - clip[1] / clip[3]) / 2 * size[1] / height]; });"""
    found = np.array(player.run(corners))
    assert found.min() > 0.03 and found.max() < 0.97
    assert np.ptp(found, axis=0).max() == pytest.approx(0.92, abs=0.01)  # of the width or the height: all but a margin
    assert found.min(0) + found.max(0) == pytest.approx([1, 1], abs=0.02)  # and in the middle
    player.page.set_viewport_size({"width": size[1], "height": size[0]})  # a phone is turned
    player.wait(f"Math.abs(e.player.view.get().azimuth - {28 + 62 - aside}) < 0.01")
    player.run("e.spread = 0")
    player.wait("Math.abs(e.player.view.get().azimuth) < 0.1")


def test_the_progress_counts_the_decoder(new_player: NewPlayer, rich: Path) -> None:
    """A decoder that is still under way is part of what is loaded."""
    player = new_player({"asset": rich})
    release = player.hold("**/*.wasm")
    player.open("asset", wait=False)
    bar = player.page.get_by_role("progressbar")
    bar.wait_for()
    player.page.wait_for_timeout(1000)  # all else is there
    shown = int(bar.get_attribute("aria-valuenow") or 0)
    assert 0 < shown < 90
    release()
    player.wait("e.ready")
