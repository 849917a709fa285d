"""A headless Chromium that cannot hang the tests: a watchdog kills it, and the next test gets a new one."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import psutil
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, sync_playwright

from facefolds_core.errors import UserError

BROWSERS = ("chromium", "google-chrome", "google-chrome-stable", "chromium-browser")
FLAGS = (
    "--use-angle=gl-egl",  # Mesa's llvmpipe: several times faster than Chromium's own software renderer
    "--ignore-gpu-blocklist",
    "--no-sandbox",  # containers run as root
    "--autoplay-policy=no-user-gesture-required",
)
THRIFTY = (
    "--disable-gpu-compositing",  # llvmpipe draws what the player draws, and no page around it
    "--in-process-gpu",
    "--renderer-process-limit=1",  # the pages of a context share a process, which stays while one is open
    "--js-flags=--no-wasm-tier-up",  # a decoder that works for a moment is not compiled twice
)
"""More flags, for tests: a page with the player takes half of the processor's time."""
VIEWPORT = {"width": 480, "height": 400}
PATIENCE = 120.0
"""Seconds that a test may take, fixtures included. Seen: 15 on a busy machine."""
ALLOWED_KILLS = 3


def find_browser() -> str | None:
    """A Chromium that starts; Ubuntu's wrapper around a snap does not, in a container."""
    for name in BROWSERS:
        path = shutil.which(name)
        if path and subprocess.run([path, "--version"], capture_output=True, check=False, timeout=60).returncode == 0:
            return path
    return None


@contextmanager
def headless(*flags: str) -> Iterator[Browser]:
    """A browser for commands that need one.

    Raises:
        UserError: if there is none.
    """
    path = find_browser()
    if path is None:
        raise UserError("no Chromium", expected=" or ".join(BROWSERS), remedy="apt-get install chromium")
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=path, args=[*FLAGS, *flags]) as browser,
    ):
        yield browser


class Chromium:
    """Starts the browser when it is asked for, and again after it was killed."""

    def __init__(self, path: str, playwright: Playwright) -> None:
        self.kills = 0
        self.path = path
        self.playwright = playwright
        self._mark = f"--facefolds-tests={uuid.uuid4().hex}"  # by which its process is known
        self._browser: Browser | None = None
        self._shared: BrowserContext | None = None

    def browser(self) -> Browser:
        if self.kills >= ALLOWED_KILLS:
            pytest.fail(f"Chromium hung and was killed {self.kills} times: it is not tried again")
        if self._browser is None or not self._browser.is_connected():
            flags = [*FLAGS, *THRIFTY, self._mark]
            env: dict[str, str | float | bool] = {**os.environ, "LP_NUM_THREADS": "0"}  # llvmpipe's
            self._browser = self.playwright.chromium.launch(executable_path=self.path, args=flags, env=env)
            self._shared = None
        return self._browser

    def shared(self) -> BrowserContext:
        """A context for pages that leave nothing behind: what their first page started serves the next ones too."""
        browser = self.browser()
        if self._shared is None:
            self._shared = browser.new_context()
            self._shared.new_page()  # stays
        return self._shared

    @contextmanager
    def page(
        self, viewport: Any = None, permissions: Sequence[str] = (), reduced_motion: Any = None, **own: Any
    ) -> Iterator[Page]:
        """A page in the shared context; with options that only a context takes, in one of its own."""
        viewport = viewport or VIEWPORT
        context = self.browser().new_context(viewport=viewport, **own) if own else self.shared()
        page = context.new_page()
        page.set_viewport_size(viewport)
        page.emulate_media(reduced_motion=reduced_motion)
        context.grant_permissions(permissions)
        yield page
        context.clear_permissions()
        page.close()
        if own:
            context.close()

    def kill(self) -> None:
        """From any thread: every call that waits for the browser fails with TargetClosedError."""
        self.kills += 1
        for process in self.processes():
            with suppress(psutil.NoSuchProcess):  # it ended meanwhile
                for member in (*process.children(recursive=True), process):
                    member.kill()

    def close(self) -> None:
        if self._browser is not None and self._browser.is_connected():
            with self.watched():
                self._browser.close()

    @contextmanager
    def watched(self, seconds: float = PATIENCE) -> Iterator[None]:
        """Kill the browser if the block takes longer."""
        timer = threading.Timer(seconds, self.kill)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def processes(self) -> list[psutil.Process]:
        """The browsers with the mark: without their helpers, which do not bear it."""
        children = psutil.Process(os.getpid()).children(recursive=True)
        return [process for process in children if self._mark in _arguments(process)]


def _arguments(process: psutil.Process) -> list[str]:
    try:
        arguments: list[str] = process.cmdline()
        return arguments
    except psutil.Error:  # it ended meanwhile
        return []
