"""Headless Chromium for the benchmarks: started, and asked what its processes took."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

from facefolds_core.errors import UserError

BROWSERS = ("chromium", "google-chrome", "google-chrome-stable", "chromium-browser")
FLAGS = (
    "--use-angle=gl-egl",  # the graphics card, or Mesa's llvmpipe where there is none
    "--ignore-gpu-blocklist",
    "--no-sandbox",  # containers run as root
    "--autoplay-policy=no-user-gesture-required",
    "--disable-gpu-vsync",
)


def find_browser() -> str:
    """A Chromium that starts.

    Raises:
        UserError: if there is none.
    """
    for name in BROWSERS:
        path = shutil.which(name)
        if path and subprocess.run([path, "--version"], capture_output=True, check=False, timeout=60).returncode == 0:
            return path
    raise UserError("no Chromium that starts", expected=" or ".join(BROWSERS), remedy="apt-get install chromium")


@contextmanager
def chromium() -> Iterator[Browser]:
    path = find_browser()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


class Processes:
    """The browser's own account of its processes."""

    def __init__(self, browser: Browser) -> None:
        self._session = browser.new_browser_cdp_session()

    def seconds(self) -> float:
        """Processor time of all of them so far."""
        return sum(float(process["cpuTime"]) for process in self._list())

    def gpu_memory(self) -> int | None:
        """Resident bytes of the process that draws (without a graphics card textures lie there); None but on Linux."""
        for process in self._list():
            status = Path(f"/proc/{process['id']}/status")
            if process["type"] == "GPU" and status.exists():
                lines = [line for line in status.read_text().splitlines() if line.startswith("VmRSS")]
                return 1024 * int(lines[0].split()[1])
        return None

    def _list(self) -> list[dict[str, str]]:
        return list(self._session.send("SystemInfo.getProcessInfo")["processInfo"])
