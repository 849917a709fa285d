"""What the page costs and how near its pixels come, by the command that measures both (bench.page)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser

from bench.page import agreement, measure, table
from tests.assets import make_asset
from tests.viewer.fixtures import add_reflection

Serve = Callable[[dict[str, Path]], str]
AGREE = 50.0
"""dB. Seen: 52.4 and more; the canvas rounds to 8 bits after each layer."""


def test_the_page_is_measured_over_a_slow_line(browser: Browser, serve: Serve, rich: Path) -> None:
    found = measure(browser, serve({"asset": rich}), 5.0, (400, 300))
    size = found["bytes"]
    assert found["picture"] >= 8 * size["until_picture"] / 5e6  # the line is as slow as was asked
    assert found["poster"] <= found["picture"] <= found["full"]
    assert 0 < found["script"] < found["thread"]
    assert 60_000 < size["script"] < 190_000  # packed; 120 kB of it JavaScript at most (test_page), the rest Draco's
    assert size["asset"] >= size["until_picture"] - size["script"] - size["page"]
    assert "| 5 Mbit/s |" in table([found])


def test_five_views_agree_with_the_command_render(browser: Browser, serve: Serve, tmp_path: Path) -> None:
    asset = make_asset(tmp_path / "asset", layers=5, frames=2, resolution=256).folder
    add_reflection(asset)
    found = agreement(browser, serve({"asset": asset}), asset)
    assert len(found) == 5 and min(found.values()) >= AGREE, found
