"""The tests' own browser: what hangs is killed, and the next test is served."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Error

from tests.chromium import ALLOWED_KILLS, Chromium


@pytest.fixture
def own(chromium: Chromium) -> Iterator[Chromium]:
    """Another browser than the one that serves the other tests."""
    another = Chromium(chromium.path, chromium.playwright)
    yield another
    another.close()


def test_a_page_that_never_answers_is_killed(own: Chromium) -> None:
    page = own.browser().new_page()
    with own.watched(1), pytest.raises(Error, match="closed"):
        page.evaluate("(() => { for (;;); })()")
    assert own.kills == 1
    assert own.browser().new_page().evaluate("1 + 1") == 2


def test_a_browser_that_stands_still_is_killed(own: Chromium) -> None:
    context = own.browser().new_context()
    for process in own.processes():
        process.suspend()
    with own.watched(1), pytest.raises(Error, match="closed"):
        context.new_page()
    assert own.kills == 1


def test_it_is_not_tried_for_ever(own: Chromium) -> None:
    own.kills = ALLOWED_KILLS
    with pytest.raises(pytest.fail.Exception, match="not tried again"):
        own.browser()
