"""An asset in a notebook: the player in a frame of the notebook's page, without a network."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page

import facefolds_core as facefolds
from facefolds_core.api import asset as shown
from tests.viewer.conftest import PATIENCE, listening


def test_an_asset_plays_in_a_notebook(
    new_page: Callable[..., Page], rich: Path, player_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shown, "find_player", lambda: player_folder)
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!doctype html><title>x</title>{facefolds.load_asset(rich)._repr_html_()}", encoding="utf-8")
    page = new_page()
    said, fetched = listening(page)
    page.goto(notebook.as_uri())
    page.frame_locator("iframe").locator("facefolds-player").wait_for()
    playing = "() => { const e = document.querySelector('facefolds-player'); return e.ready && e.playing; }"
    page.frames[1].wait_for_function(playing, timeout=PATIENCE)
    assert said == []
    assert {url for url in fetched if not url.startswith(("data:", "blob:"))} <= {notebook.as_uri(), "about:srcdoc"}
