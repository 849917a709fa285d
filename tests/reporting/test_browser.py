"""The page in headless Chromium: nothing is fetched, nothing fails, the divider moves, it fits a phone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page

from facefolds_core.reporting.build import make_report
from tests.reporting.tiny import FRAMES, make_subject
from tests.viewer.conftest import listening

PHONE, DESKTOP = {"width": 390, "height": 844}, {"width": 1280, "height": 900}
PANELS = [
    *("Truth, asset, error", "Scores", "Cameras", "Textures of one frame"),
    *("Training", "What ships", "Time and bytes by stage", "Configuration"),
]

Open = Callable[..., Page]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_report(make_subject(tmp_path_factory.mktemp("browser") / "somebody"))


@pytest.fixture
def open_report(new_page: Callable[..., Page], report: Path) -> Iterator[Open]:
    """Opens the page; fails if it says or fetches anything."""
    noted: list[tuple[list[str], list[str]]] = []

    def start(**options: object) -> Page:
        page = new_page(**({"viewport": DESKTOP} | options))
        noted.append(listening(page))
        page.goto(report.as_uri())
        return page

    yield start
    for said, fetched in noted:
        assert said == []
        assert {url for url in fetched if not url.startswith("data:")} == {report.as_uri()}


@pytest.mark.parametrize("viewport", [PHONE, DESKTOP], ids=["phone", "desktop"])
def test_all_panels_are_there_and_fit(open_report: Open, viewport: dict[str, int]) -> None:
    page = open_report(viewport=viewport)
    assert page.locator("h2").all_inner_texts() == PANELS
    assert page.evaluate("document.documentElement.scrollWidth") == viewport["width"]
    assert page.evaluate("[...document.images].filter((i) => !i.naturalWidth).length") == 0
    outside = """[...document.querySelectorAll('main *')].filter((e) => !e.closest('.scroll, svg')
        && e.getBoundingClientRect().right > innerWidth).length"""
    assert page.evaluate(outside) == 0


def test_every_tile_says_something_and_one_says_the_assets_size(open_report: Open) -> None:
    page = open_report()
    values = page.locator(".tiles .value").all_inner_texts()
    assert len(values) > 3 and all(value.strip(" –") for value in values)
    (size,) = page.locator(".tiles > div", has_text="Size").locator(".value").all_inner_texts()
    assert re.fullmatch(r"\d+\sKB", size)


def test_the_worst_place_fills_its_column(open_report: Open) -> None:
    page = open_report()
    width = "document.querySelector('.worst{}').getBoundingClientRect().width"
    assert page.evaluate(width.format(" img")) == page.evaluate(width.format("")) > 200


def test_it_follows_light_and_dark(open_report: Open) -> None:
    colours = []
    for scheme in ("light", "dark"):
        page = open_report(color_scheme=scheme)
        colours.append(page.evaluate("getComputedStyle(document.body).backgroundColor"))
    levels = [sum(map(int, re.findall(r"\d+", colour))) for colour in colours]
    assert levels[0] > 600
    assert levels[1] < 150


def test_any_frame_of_the_film_is_shown_by_its_name(open_report: Open) -> None:
    page = open_report(reduced_motion="reduce")  # it does not play by itself
    film = page.locator("#film")
    film.evaluate("v => v.readyState >= 2 || new Promise((done) => v.addEventListener('loadeddata', done))")
    assert film.evaluate("v => v.paused")
    page.get_by_role("slider", name="Frame").fill("2")
    film.evaluate("v => !v.seeking || new Promise((done) => v.addEventListener('seeked', done))")
    assert page.locator("#frame-name").inner_text() == f"000002 (3 of {FRAMES})"
    assert film.evaluate("v => Math.floor(v.currentTime * 30)") == 2
    page.locator(".screen").press("ArrowLeft")
    film.evaluate("v => !v.seeking || new Promise((done) => v.addEventListener('seeked', done))")
    assert film.evaluate("v => Math.floor(v.currentTime * 30)") == 1


def test_a_film_shows_both_halves_one_or_one_after_the_other(open_report: Open) -> None:
    page = open_report()
    wide = page.locator(".screen").bounding_box()
    seen = {}
    for how in ("photo", "asset", "blink"):
        page.get_by_label("How to compare films").select_option(how)
        seen[how] = page.locator("#film").evaluate(
            "v => [getComputedStyle(v).transform, getComputedStyle(v).animationName]"
        )
    half = page.locator(".screen").bounding_box()
    assert wide is not None and half is not None
    assert half["width"] / half["height"] == pytest.approx(0.5 * wide["width"] / wide["height"], rel=0.02)
    assert seen["photo"][0] == "none" and float(seen["asset"][0].split(",")[4]) < -50  # moved to the left by half
    assert seen["blink"][1] == "other-half"


def test_it_prints_on_two_pages_at_most_with_the_assets_picture(open_report: Open) -> None:
    page = open_report()
    picture = page.get_by_alt_text("The asset", exact=True)
    assert not picture.is_visible()
    page.emulate_media(media="print")
    assert picture.is_visible() and picture.evaluate("image => image.naturalWidth") > 0
    printed = page.pdf(format="A4", prefer_css_page_size=True)
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) <= 2
