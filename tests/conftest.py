"""Fixtures that every test may use."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

import stages  # noqa: F401  (threads that wait sleep, as a stage's do: workers share the cores; before torch is imported)
from tests.chromium import BROWSERS, Chromium, find_browser

ROOT = Path(__file__).resolve().parents[1]
BROWSER = (
    "tests/viewer/",
    "tests/reporting/test_browser.py",
    "tests/documents/test_site_pages.py",
    "tests/core/test_chromium.py",
)
RUN_ONCE = ("tests/pipeline/test_end_to_end.py", "tests/pipeline/test_commands.py")
"""Tests of one project that DVC has run."""
COMPILED = ("tests/captures/test_actor_pictures.py",)
"""The actor's renderer: in a fresh clone it is compiled for 40 s, which one worker should do before others need it."""
LONGEST = (*COMPILED, *RUN_ONCE, *BROWSER, "tests/pipeline/", "tests/training/", "tests/hostile/")
"""What several workers begin with. Of two, one compiles the actor's renderer, the other runs the project; who is done
goes on with the browser, which needs no kernel of a training: none is compiled twice."""


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
def rich(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An asset with all that the format knows, not to be changed."""
    from tests.viewer.fixtures import rich_asset  # here: most tests need none of it

    return rich_asset(tmp_path_factory.mktemp("rich") / "asset")


@pytest.fixture(scope="session")
def vectors(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The conformance vectors, not to be changed."""
    from tests.vectors import write_vectors

    folder = tmp_path_factory.mktemp("made") / "vectors"
    count = write_vectors(folder)
    assert count == len(list((folder / "reference").iterdir())) == len(list((folder / "reference_points").iterdir()))
    return folder


@pytest.fixture
def rich_copy(rich: Path, tmp_path: Path) -> Path:
    """The same, to spoil."""
    return Path(shutil.copytree(rich, tmp_path / "asset"))


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


@pytest.fixture
def new_page(browser: Browser, chromium: Chromium) -> Iterator[Callable[..., Page]]:
    """Opens pages (`Chromium.page`) for as long as the test lasts."""
    with ExitStack() as pages:
        yield lambda **options: pages.enter_context(chromium.page(**options))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what runs DVC or a browser, for `make check`; begin with what takes longest, for several workers.

    A browser that hung, and was killed, gets one more chance; a test that found something wrong gets none.
    """
    for item in items:
        if item.path.is_relative_to(ROOT / "tests" / "pipeline"):
            item.add_marker(pytest.mark.pipeline)
        fixtures = getattr(item, "fixturenames", ())
        if "chromium" in fixtures or "player_folder" in fixtures:
            item.add_marker(pytest.mark.browser)
        if "browser" in fixtures:
            item.add_marker(pytest.mark.flaky(reruns=1, only_rerun=["TargetClosedError"]))
    items.sort(key=lambda item: _rank(item.nodeid))


def _rank(nodeid: str) -> int:
    return next((i for i, start in enumerate(LONGEST) if nodeid.startswith(start)), len(LONGEST))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """With `-n`: a worker gets whole files, so that what they share is made once; one has the run."""
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return "run once" if nodeid.startswith(RUN_ONCE) else nodeid.split("::")[0]

    config.option.loadscopereorder = False
    return ByFile(config, log)
