"""What can go wrong is said in words, with what to do about it; nothing is left blank or uncaught."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.viewer.conftest import NewPlayer, Show, page_of_yours
from tests.viewer.fixtures import change_manifest, file_entry, flipped

NOT_FOUND = "Failed to load resource"  # the browser's own line about an answer of 404
GONE = "net::ERR_"


@pytest.fixture
def asset(rich_copy: Path) -> Path:
    return rich_copy


@pytest.fixture
def one_level(rich_copy: Path) -> Path:
    """Nothing to fall back to."""
    change_manifest(rich_copy, lambda value: value.update(levels=value["levels"][:1]))
    return rich_copy


NO_WEBGL = """const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
          return kind === 'webgl2' ? null : get.call(this, kind, ...rest); };"""


def test_without_webgl2(show: Show) -> None:
    """The poster stands in, above the words."""
    player = show(wait=False, script=NO_WEBGL)
    text = player.message()
    assert "no WebGL 2" in text
    assert "hardware acceleration" in text
    player.page.get_by_role("img", name="The subject, from the front").wait_for()
    shown, words = player.box(".poster"), player.box(".message > div")
    assert shown["height"] > 200 and words["y"] >= shown["y"] + shown["height"]
    red = player.run("const image = e.shadowRoot.querySelector('.poster'); return [image.naturalWidth, image.complete]")
    assert red == [90, True]


@pytest.mark.parametrize("script", ["", NO_WEBGL], ids=["loading", "no WebGL"])
def test_a_poster_of_the_pages_own(new_player: NewPlayer, rich: Path, script: str) -> None:
    player = new_player({"asset": rich}, script=script)
    release = player.hold("**/*.mp4")
    page_of_yours(
        player,
        '<facefolds-player src="asset/" poster="asset/photo0.png" alt="Ann" style="height:300px"></facefolds-player>',
    )
    poster = player.page.locator(".poster")
    poster.wait_for()
    assert player.run("return e.shadowRoot.querySelector('.poster').src.endsWith('photo0.png')")
    assert not any(url.endswith("poster.png") for url in player.requests)
    if script:
        player.page.get_by_role("img", name="Ann").wait_for()
        return
    release()
    player.wait("e.ready")
    player.wait("e.shadowRoot.querySelector('.poster').matches('.gone')")


def test_no_asset_at_the_address(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich}, allow=(NOT_FOUND,))
    player.open("nowhere", wait=False)
    assert "manifest.json is missing" in player.message()
    assert not player.page.locator(".bar").is_visible()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON"),
        ("[]", "not a facefolds asset"),
        ('{"format": "facefolds", "version": 4}', "levels is not a list"),
        ('{"format": "facefolds", "version": 3}', "this player reads version 4"),
        ('{"format": "facefolds", "version": 5, "minVersion": 5}', "too old"),
    ],
)
def test_a_manifest_that_is_garbled_or_of_another_format(show: Show, asset: Path, text: str, said: str) -> None:
    (asset / "manifest.json").write_text(text)
    assert said in show(asset=asset, wait=False).message()


def spoil_missing(asset: Path) -> str:
    (asset / "coarse_meshes.bin").unlink()
    return "coarse_meshes.bin is missing"


def spoil_short(asset: Path) -> str:
    path = asset / "coarse.mp4"
    path.write_bytes(path.read_bytes()[:-100])
    return "coarse.mp4 is damaged"


def spoil_changed(asset: Path) -> str:
    path = asset / "coarse_meshes.bin"
    path.write_bytes(flipped(path.read_bytes(), 200))
    return "content was changed"


def spoil_mesh(asset: Path) -> str:
    """Garbage whose checksum is right."""
    path = asset / "coarse_meshes.bin"
    path.write_bytes(b"\x01" * path.stat().st_size)
    change_manifest(asset, lambda value: value["levels"][0]["meshes"][0].update(sha256=file_entry(path)["sha256"]))
    return "not a Draco mesh"


def spoil_video(asset: Path) -> str:
    path = asset / "coarse.mp4"
    path.write_bytes(b"\x01" * 300)
    change_manifest(asset, lambda value: value["levels"][0]["texture"]["videos"][0].update(file_entry(path)))
    return "cannot decode the asset's video"


def spoil_codec(asset: Path) -> str:
    mime = 'video/mp4; codecs="hvc9.1"'
    change_manifest(asset, lambda value: value["levels"][0]["texture"]["videos"][0].update(mime=mime))
    return "h264: not supported"


@pytest.mark.parametrize(
    "spoil",
    [
        *(spoil_missing, spoil_changed, spoil_video),
        *(pytest.param(spoil, marks=pytest.mark.nightly) for spoil in (spoil_short, spoil_mesh, spoil_codec)),
    ],
    ids=lambda f: f.__name__[6:],
)
def test_a_file_that_is_missing_or_damaged(show: Show, one_level: Path, spoil: Callable[[Path], str]) -> None:
    said = spoil(one_level)
    text = show(asset=one_level, wait=False, allow=(NOT_FOUND,)).message()
    assert said in text
    assert "Try again" in text


def test_try_again_loads_again(show: Show, one_level: Path, tmp_path: Path) -> None:
    (one_level / "coarse.mp4").rename(tmp_path / "away")
    player = show(asset=one_level, wait=False, allow=(NOT_FOUND,))
    player.message()
    (tmp_path / "away").rename(one_level / "coarse.mp4")
    player.button("Try again")
    player.wait("e.ready")
    assert not player.page.get_by_role("alert").is_visible()


@pytest.mark.parametrize(
    ("damaged", "left", "view"),
    [
        ("full", "coarse", "frame=0"),
        ("coarse", "full", "frame=0"),
        ("full", "coarse", "level=full&frame=0"),  # though it was asked for
    ],
)
def test_a_damaged_level_gives_way_to_the_other(show: Show, asset: Path, damaged: str, left: str, view: str) -> None:
    (asset / f"{damaged}_meshes.bin").unlink()
    player = show(view, asset=asset, allow=(NOT_FOUND,))
    assert f"{damaged}_meshes.bin is missing" in player.notice()
    assert player.run("e.play(); return [e.level, e.playing]") == [left, True]


@contextmanager
def plain_server(folder: Path) -> Iterator[str]:
    """A static server that sends no headers of its own."""

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder))) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}/"
        server.shutdown()
        thread.join()


def test_another_server_that_does_not_allow_it(
    new_player: NewPlayer, rich: Path, player_folder: Path, tmp_path: Path
) -> None:
    """CORS, and a policy of the page, are told apart from a server that is gone."""
    site = Path(shutil.copytree(player_folder, tmp_path / "site"))
    player = new_player({"asset": rich}, allow=("CORS", GONE, "Content Security Policy", "Content-Security-Policy"))
    with plain_server(rich) as other, plain_server(site) as mine:
        (site / "yours.html").write_text(
            '<!doctype html><link rel="icon" href="data:,"><script type="module" src="facefolds-player.js"></script>'
            f'<facefolds-player src="{other}"></facefolds-player>'
        )
        player.page.goto(f"{mine}yours.html")
        assert "(CORS)" in player.message()
        player.page.goto(f"{player.address}?src={other}")  # its policy allows its own server only
        assert "Content-Security-Policy" in player.message()


def test_the_page_opened_as_a_file_says_what_to_do(new_page: Callable[..., Page], player_folder: Path) -> None:
    page = new_page()
    page.goto((player_folder / "index.html").as_uri())
    assert "facefolds export-html" in page.locator("#words").inner_text()


def test_it_goes_on_by_itself_when_the_connection_is_back(show: Show) -> None:
    player = show(allow=(NOT_FOUND, GONE))
    player.page.context.set_offline(True)
    player.run("e.setAttribute('src', '/asset/?again')")
    assert "cannot be reached" in player.message()
    assert player.run("return e.shadowRoot.activeElement.dataset.do") == "again"
    player.page.context.set_offline(False)
    player.wait("e.ready")
    assert not player.page.get_by_role("alert").is_visible()


def test_a_broken_stream_falls_back_to_the_second_video(show: Show, asset: Path) -> None:
    """The MP4's coded pictures are garbage: the decoder gives up, the WebM of the same level is taken."""
    path = asset / "full.mp4"
    data = path.read_bytes()
    start = data.index(b"mdat") + 4
    path.write_bytes(data[:start] + bytes(len(data) - start))
    change_manifest(asset, lambda value: value["levels"][1]["texture"]["videos"][0].update(file_entry(path)))
    assert show(asset=asset, full=True).run("return e.statistics.video") == "vp9"


def test_a_lost_context_is_said_and_comes_back(show: Show) -> None:
    player = show(full=True)
    before = player.capture()
    player.run(
        """const { gl } = e.player.renderer.graphics;
        window.lose = gl.getExtension('WEBGL_lose_context'); lose.loseContext();"""
    )
    assert "graphics context was lost" in player.message()
    player.run("lose.restoreContext()")
    player.page.get_by_role("alert").wait_for(state="hidden")
    assert abs(player.capture() - before).max() == 0


def test_a_server_that_is_gone(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich}, allow=(NOT_FOUND, GONE))
    player.page.route("**/coarse.mp4", lambda route: route.abort())
    player.open("asset", wait=False)
    assert "server cannot be reached" in player.message()


def test_no_source(show: Show) -> None:
    player = show()
    player.run("e.removeAttribute('src')")
    assert "No asset was named" in player.message()
