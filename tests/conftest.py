"""Fixtures that every test may use."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.chromium import BROWSERS, Chromium, find_browser

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def project_root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def captures_folder() -> Path:
    """The shared captures (never part of the repository); skips, aloud, where they are missing."""
    folder = Path(os.environ.get("FACEFOLDS_CAPTURES", ROOT.parent / "shared" / "captures"))
    if not folder.is_dir():
        pytest.skip(f"no captures at {folder}; set FACEFOLDS_CAPTURES to their folder to run this test")
    return folder


@pytest.fixture(scope="session")
def chromium() -> Iterator[Chromium]:
    path = find_browser()
    if path is None:
        pytest.skip(f"no browser that starts (tried {', '.join(BROWSERS)}): apt-get install chromium")
    with sync_playwright() as playwright:
        running = Chromium(path, playwright)
        yield running
        running.close()


@pytest.fixture
def browser(chromium: Chromium) -> Iterator[Browser]:
    """A browser that is killed when the test hangs; the test then fails, and is run once more in a new one."""
    with chromium.watched():
        yield chromium.browser()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A browser that hung, and was killed, gets one more chance; a test that found something wrong gets none."""
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.flaky(reruns=1, only_rerun=["TargetClosedError"]))
