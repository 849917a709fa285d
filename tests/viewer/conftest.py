"""The web player in headless Chromium: what its tests share. Without a browser or Node.js they skip, aloud."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import FloatRect, Page, Route

from facefolds_core.geometry.cameras import Camera
from facefolds_core.serving.server import serving
from facefolds_core.system.locks import holding
from tests.pictures import GREY
from tests.viewer.captured import captured

PATIENCE = 60_000
"""Milliseconds for what takes one: software rendering on a busy machine."""
ELEMENT = "document.querySelector('facefolds-player')"
NO_WEBCODECS = "delete globalThis.VideoDecoder"


@pytest.fixture(scope="session")
def player_folder(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The player, built from what stands in the work tree: by one of several workers."""
    npm, source = shutil.which("npm"), project_root / "viewer"
    if npm is None:
        pytest.skip("no npm: the web player cannot be built (apt-get install nodejs npm)")
    run = tmp_path_factory.getbasetemp()
    done = (run.parent if "PYTEST_XDIST_WORKER" in os.environ else run) / "player-built"  # the workers' common folder
    with holding(done.with_suffix(".lock"), 600) as free:
        assert free, "another worker builds the player, and does not end"
        if not done.exists():
            installed = source / "node_modules" / ".package-lock.json"
            if not installed.is_file() or installed.stat().st_mtime < (source / "package-lock.json").stat().st_mtime:
                subprocess.run([npm, "ci", "--no-audit", "--no-fund", "--loglevel=error"], cwd=source, check=True)
            subprocess.run([npm, "run", "--silent", "build"], cwd=source, check=True, capture_output=True)
            done.touch()
    return source / "dist"


class Player:
    """A page with the player on it, and what the page said."""

    def __init__(self, page: Page, address: str) -> None:
        self.page = page
        self.address = address
        self.said: list[str] = []
        self.requests: list[str] = []
        page.on("console", lambda message: self._note(message.type, message.text))
        page.on("pageerror", lambda error: self.said.append(f"uncaught: {error}"))
        page.on("request", lambda request: self.requests.append(request.url))

    def _note(self, kind: str, text: str) -> None:
        if kind in ("error", "warning"):
            self.said.append(f"{kind}: {text}")

    def open(self, asset: str, view: str = "frame=0", wait: bool = True, full: bool = False) -> None:
        """Open the page with the asset served as `asset`; by default at rest, at frame 0. `full`: at its full level."""
        self.page.goto(f"{self.address}?src={asset}/#{view}")
        if wait:
            self.wait("e.ready")
        if full:
            self.wait("e.level === 'full'")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript condition on the element `e` holds."""
        self.page.wait_for_function(f"() => {{ const e = {ELEMENT}; return {condition}; }}", timeout=PATIENCE)

    def run(self, code: str, value: object = None) -> Any:
        """Run JavaScript with the element as `e` and `value` as `v`; returns its result."""
        return self.page.evaluate(f"async (v) => {{ const e = {ELEMENT}; {code} }}", value)

    def hold(self, addresses: str) -> Callable[[], None]:
        """Hold back what the page asks for there; what is returned waits until it does, and lets go of it."""
        held: list[Route] = []
        self.page.route(addresses, lambda route: held.append(route))

        def release() -> None:
            while not held:
                self.page.wait_for_timeout(20)
            for route in held:
                route.continue_()

        return release

    def button(self, name: str) -> None:
        """Press the first visible button with that accessible name."""
        self.page.get_by_role("button", name=name).first.click()

    def message(self) -> str:
        """The failure that is shown over all."""
        box = self.page.get_by_role("alert")
        box.wait_for(timeout=PATIENCE)
        return box.inner_text()

    def notice(self) -> str:
        box = self.page.locator(".toast")
        box.wait_for(timeout=PATIENCE)
        return box.inner_text()

    def capture(self, camera: Camera | None = None) -> NDArray[np.float64]:
        """What is shown: (H, W, 4) in [0, 1]."""
        return captured(self.page, camera)

    def boxes(self, selector: str) -> list[FloatRect]:
        """Where all that match lie, CSS pixels; every one of them can be seen."""
        found = [one.bounding_box() for one in self.page.locator(selector).all()]
        assert found and all(found), selector
        return [box for box in found if box]

    def box(self, selector: str) -> FloatRect:
        (found,) = self.boxes(selector)
        return found


MouseButton = Literal["left", "right"]
NewPlayer = Callable[..., Player]
Show = Callable[..., Player]


def swipe(player: Player, *fingers: Sequence[tuple[float, float]]) -> None:
    """Fingers touch the screen, each at its first (x, y), go on to the others, and leave it."""
    client = player.page.context.new_cdp_session(player.page)
    for k, points in enumerate([*zip(*fingers, strict=True), ()]):
        kind = "touchStart" if k == 0 else "touchMove" if points else "touchEnd"
        places = [{"x": x, "y": y} for x, y in points]
        client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})


def drag(player: Player, place: tuple[float, float], by: tuple[float, float], button: MouseButton = "left") -> None:
    """With the mouse, from a place."""
    player.page.mouse.move(*place)
    player.page.mouse.down(button=button)
    player.page.mouse.move(place[0] + by[0], place[1] + by[1], steps=5)
    player.page.mouse.up(button=button)


def page_of_yours(
    player: Player,
    body: str,
    script: str = "facefolds-player.js",
    style: str = 'style="margin:0"',
    policy: str | None = None,
) -> None:
    """Open a page with `body` and a module, by default the player's, from the player's own server."""
    module = f'<script type="module" src="{script}"></script>'
    head = '<!doctype html><meta name="viewport" content="width=device-width">'
    html = f'{head}<link rel="icon" href="data:,">{module}<body {style}>{body}</body>'
    given = {"body": html, "headers": {"Content-Type": "text/html"}}
    if policy is not None:
        given["headers"]["Content-Security-Policy"] = policy
    player.page.route("**/yours.html", lambda route: route.fulfill(**given))
    player.page.goto(f"{player.address}yours.html")


def element(
    new_player: NewPlayer,
    asset: Path,
    attributes: str = "",
    inner: str = "",
    size: tuple[int, int] = (400, 300),
    **options: object,
) -> Player:
    """A page of yours with an element, as large as the window, that shows the asset at its full level."""
    player = new_player({"asset": asset}, viewport={"width": size[0], "height": size[1]}, **options)
    style = f"height: {size[1]}px"
    page_of_yours(player, f'<facefolds-player src="asset/" style="{style}" {attributes}>{inner}</facefolds-player>')
    player.wait("e.level === 'full'")
    return player


def listening(page: Page) -> tuple[list[str], list[str]]:
    """What a page says on its console or as an error, and the addresses that it asks for, from now on."""
    said: list[str] = []
    fetched: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: fetched.append(request.url))
    return said, fetched


@pytest.fixture
def serve(player_folder: Path) -> Iterator[Callable[[dict[str, Path]], str]]:
    """Serves assets by name together with the player for as long as the test lasts; returns the address."""
    open_servers = []

    def start(assets: dict[str, Path]) -> str:
        server = serving(player_folder, assets)
        open_servers.append(server)
        return server.__enter__()

    yield start
    for server in open_servers:
        server.__exit__(None, None, None)


@pytest.fixture
def new_player(new_page: Callable[..., Page], serve: Callable[[dict[str, Path]], str]) -> Iterator[NewPlayer]:
    """A page with the player; fails if the console holds an error or a warning that is not allowed."""
    players: list[tuple[Player, tuple[str, ...]]] = []

    def make(assets: dict[str, Path], allow: tuple[str, ...] = (), script: str = "", **options: object) -> Player:
        page = new_page(**options)
        if script:
            page.add_init_script(script)
        player = Player(page, serve(assets))
        players.append((player, allow))
        return player

    yield make
    for player, allow in players:
        player.page.close()
        unexpected = [line for line in player.said if not any(part in line for part in allow)]
        assert unexpected == []


@pytest.fixture
def show(new_player: NewPlayer, rich: Path) -> Show:
    """The page with an asset on it, by default `rich`; takes what `Player.open` and `new_player` take."""

    def shown(
        view: str = "frame=0", full: bool = False, wait: bool = True, asset: Path = rich, **options: object
    ) -> Player:
        player = new_player({"asset": asset}, **options)
        player.open("asset", view, wait, full)
        return player

    return shown


@pytest.fixture
def opened(show: Show) -> Show:
    """`show` at its full level, on grey, without the reflection."""

    def of(**options: object) -> Player:
        player = show(full=True, **options)
        player.run("e.background = v; e.effects = false", GREY)
        return player

    return of
