"""Ours, one mesh with a video and splats, live: turned together, and named with their bytes."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from bench.equal_bytes import SPLAT_BYTES, TARGET, write_page
from facefolds_core.serving.server import serving
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, TURN, Splats
from tests.assets import make_asset
from tests.viewer.conftest import ELEMENT, PATIENCE, listening

BESIDE, DISTANCE = 0.05, 0.9
"""Of the splats from the middle, of the page's camera from it: units."""


def red_ball(beside: float, count: int = 300) -> Splats:
    """In front of the middle that all turn about, units."""
    places = np.random.default_rng(0).normal(0, 0.006, (count, 3))
    values = np.zeros((count, COLUMNS), np.float32)
    values[:, MEAN] = places + TARGET + (beside, 0, 0)
    values[:, SCALE], values[:, TURN.start], values[:, OPACITY] = np.log(0.004), 1, 4
    values[:, COLOUR] = (1, 0, 0)
    return Splats(values, np.zeros(3, np.float32))


def shot_of(page: Page) -> bytes:
    """The pane of the splats, a PNG."""
    return page.locator("figure").nth(2).locator("canvas").screenshot(timeout=PATIENCE)


def red_column(page: Page, azimuth: int) -> float:
    """Where it is seen in the pane of the splats, turned so far: pixels to the right of that pane's middle."""
    turn = "(v) => { const e = document.querySelector('input'); e.value = v; e.dispatchEvent(new Event('input')) }"
    page.evaluate(turn, azimuth)
    before, shot = b"", shot_of(page)
    while shot != before:  # drawn again until the splats are in order
        page.wait_for_timeout(1000)
        before, shot = shot, shot_of(page)
    rgb = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")) / 255
    rows, columns = np.nonzero(rgb[..., 0] - rgb[..., 1] > 0.3)
    assert len(columns) > 100 and rows.mean() == pytest.approx(rgb.shape[0] / 2, abs=2)
    return float(columns.mean() - rgb.shape[1] / 2)


def test_three_panes_are_turned_together(player_folder: Path, tmp_path: Path, new_page: Callable[..., Page]) -> None:
    """The splats as far and as large as the player beside them shows what stands there."""
    ours = make_asset(tmp_path / "ours", layers=2, frames=2, resolution=32)
    mesh = make_asset(tmp_path / "mesh", layers=1, frames=2, resolution=32)
    ball = red_ball(BESIDE)
    write_page(tmp_path / "page", ours, mesh, ball)
    page = new_page(viewport={"width": 900, "height": 500})
    said, _ = listening(page)
    with serving(tmp_path / "page", {}) as address:
        page.goto(address)
        page.wait_for_selector("body[data-ready]", timeout=PATIENCE)
        names = page.locator("figcaption").all_inner_texts()
        scale = float(page.evaluate(f"{ELEMENT}.player.view.pixelsAUnit"))
        found = [red_column(page, azimuth) for azimuth in (-60, 0, 60)]
        views = page.evaluate(
            "[...document.querySelectorAll('facefolds-player')].map((e) => Math.round(e.state.view.azimuth))"
        )
    shift = scale * DISTANCE * BESIDE * math.sin(math.pi / 3) / (DISTANCE - BESIDE * math.cos(math.pi / 3))
    assert found == pytest.approx([shift, 0, -shift], abs=2)
    assert views == [60, 60] and said == []
    sizes = [round(size / 1000) for size in (ours.full.entry.bytes, mesh.full.entry.bytes, SPLAT_BYTES * len(ball))]
    assert [int(name.split(": ")[1].split(" KB")[0]) for name in names] == sizes
