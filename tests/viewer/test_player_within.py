"""The player within a page from the disk, of the report and of a notebook, without a network."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page

import facefolds_core as facefolds
from facefolds_core.api import asset as shown_asset
from facefolds_core.asset import read_asset
from facefolds_core.reporting import face
from facefolds_core.reporting.build import make_report
from tests.reporting.tiny import make_subject
from tests.viewer.conftest import PATIENCE, listening

PLAYING = "() => { const e = document.querySelector('facefolds-player'); return e.ready && e.playing; }"


def test_the_face_plays_in_the_report(new_page: Callable[..., Page], player_folder: Path, tmp_path: Path) -> None:
    report = make_report(make_subject(tmp_path / "somebody"), player=player_folder)
    page = new_page(viewport={"width": 1440, "height": 900})
    said, fetched = listening(page)
    page.goto(report.as_uri())
    inner = page.frame_locator("iframe").locator("facefolds-player")
    inner.wait_for()
    frame = page.frames[1]
    frame.wait_for_function(PLAYING, timeout=PATIENCE)
    fold = [page.locator(part).bounding_box() for part in ("iframe", ".worst img >> nth=0")]
    assert all(box is not None and box["y"] + box["height"] <= 900 for box in fold)  # both at the first glance
    assert said == []
    assert {url for url in fetched if not url.startswith(("data:", "blob:"))} == {report.as_uri()}


def test_a_level_that_the_page_has_no_room_for_is_left_out(
    player_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asset = read_asset(make_subject(tmp_path / "somebody").asset)
    shown = face.face(asset, player_folder)
    assert shown is not None and shown["level"] == "full"
    monkeypatch.setattr(face, "MOST_FACE_BYTES", 100)
    assert face.face(asset, player_folder) is None


def test_an_asset_plays_in_a_notebook(
    new_page: Callable[..., Page], rich: Path, player_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shown_asset, "find_player", lambda: player_folder)
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!doctype html><title>x</title>{facefolds.load_asset(rich)._repr_html_()}", encoding="utf-8")
    page = new_page()
    said, fetched = listening(page)
    page.goto(notebook.as_uri())
    page.frame_locator("iframe").locator("facefolds-player").wait_for()
    page.frames[1].wait_for_function(PLAYING, timeout=PATIENCE)
    assert said == []
    assert {url for url in fetched if not url.startswith(("data:", "blob:"))} <= {notebook.as_uri(), "about:srcdoc"}
