"""The site in Chromium, opened as files: search, nothing from other hosts, and nothing cut off, at two sizes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page

WIDTHS = (1440, 390)
NewPage = Callable[..., Page]
PAGES = ("index", "guide/results", "guide/engines", "reference/params", "research/results")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, project_root: Path) -> Path:
    """As `make docs` builds it."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    subprocess.run(command, cwd=project_root, check=True, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"})
    return folder


def opened(new_page: NewPage, file: Path, width: int = 1440) -> tuple[Page, list[str]]:
    """The page, and what it said or asked other hosts for."""
    page, noted = new_page(viewport={"width": width, "height": 844}), []
    page.on("request", lambda request: noted.append(request.url) if request.url.startswith("http") else None)
    page.on("console", lambda message: noted.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: noted.append(str(error)))
    page.goto(file.as_uri())
    return page, noted


def test_search_finds_pages_of_files(new_page: NewPage, site: Path) -> None:
    page, noted = opened(new_page, site / "guide" / "viewer.html")
    page.locator(".md-search__input").click()
    page.keyboard.type("alphaMode")
    found = page.locator(".md-search-result__link")
    found.first.wait_for(timeout=30_000)
    assert any("asset-format.html" in (link.get_attribute("href") or "") for link in found.all())
    assert noted == []


@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_cut_off(new_page: NewPage, site: Path, width: int) -> None:
    """Pages are as wide as the window; wider tables can be scrolled."""
    for name in PAGES:
        page, noted = opened(new_page, site / f"{name}.html", width)
        page.wait_for_function(
            "() => [...document.querySelectorAll('article table')].every(t => t.closest('.md-typeset__scrollwrap'))"
        )
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        cut = """[...document.querySelectorAll('.md-typeset__scrollwrap')].filter((box) =>
            box.scrollWidth > box.clientWidth + 1 && getComputedStyle(box).overflowX !== 'auto').length"""
        assert page.evaluate(cut) == 0, name
        assert noted == [], name


def test_expert_keys_are_closed_until_they_are_asked_for(new_page: NewPage, site: Path) -> None:
    page, _ = opened(new_page, site / "reference" / "params.html", 390)
    assert page.evaluate("document.documentElement.scrollHeight") < 20_000
    tables = page.locator("details.keys")
    assert tables.count() > 10
    assert not tables.first.locator("table").is_visible()
    tables.first.locator("summary").click()
    assert tables.first.locator("table").is_visible()


def test_the_chart_of_the_first_page_needs_no_script(new_page: NewPage, site: Path) -> None:
    page, _ = opened(new_page, site / "index.html")
    assert page.locator("ol.steps li").all_inner_texts()[0] == "calibrated films"
    assert page.locator(".mermaid").count() == 0
