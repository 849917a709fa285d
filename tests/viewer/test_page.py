"""Loading, the page around the player, embedding, and that nothing comes from anywhere else."""

from __future__ import annotations

import gzip
import shutil
import subprocess
from pathlib import Path
from urllib.parse import urlsplit

from tests.viewer.conftest import NewPlayer, Show


def test_the_coarse_level_comes_first_and_the_full_one_follows(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich})
    player.page.add_init_script(
        """addEventListener('DOMContentLoaded', () => { window.seen = [];
        const e = document.querySelector('facefolds-player');
        for (const name of ['ready', 'level']) e.addEventListener(name, () => seen.push([name, e.level])); });"""
    )
    player.open("asset", full=True)
    assert player.page.evaluate("seen") == [["ready", "coarse"], ["level", "coarse"], ["level", "full"]]
    order = [Path(urlsplit(url).path).name for url in player.requests]
    assert order.index("coarse.mp4") < order.index("full.mp4")
    assert "full.webm" not in order  # the first video plays: the second is not fetched


def test_a_poster_and_progress_are_shown_before_the_first_picture(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich})
    release = player.hold("**/coarse.mp4")
    player.open("asset", wait=False)
    player.page.locator(".poster").wait_for()
    assert player.page.get_by_role("progressbar").is_visible()
    assert player.page.get_by_text("Loading").is_visible()
    release()
    player.wait("e.ready")
    assert not player.page.get_by_role("progressbar").is_visible()


def test_progress_is_shown_before_the_script_is_there(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich})
    release = player.hold("**/page.js")
    player.page.goto(f"{player.address}?src=asset/", wait_until="commit")
    code = "getComputedStyle(document.querySelector('facefolds-player'), '::after').content"
    player.page.wait_for_function(f"() => document.querySelector('facefolds-player') && {code} === '\"Loading\"'")
    release()
    player.wait("e.ready")
    assert player.page.evaluate(code) == "none"


def test_all_requests_stay_on_the_server(show: Show) -> None:
    player = show("")
    player.wait("e.level === 'full' && e.playing")
    hosts = {urlsplit(url).netloc for url in player.requests if not url.startswith(("blob:", "data:"))}
    assert hosts == {urlsplit(player.address).netloc}


def test_the_address_follows_the_view(show: Show) -> None:
    player = show()
    player.run("e.spread = 0.25; await e.step(2)")
    player.page.wait_for_function("() => location.hash.includes('spread=0.25') && location.hash.includes('frame=2')")


def test_nonsense_in_the_address_is_left_out(show: Show) -> None:
    player = show("view=a,b&frame=-3&level=../../x&background=zzz&speed=-1&hidden=x")
    assert player.run("return [e.frame >= 0, e.speed, e.background]") == [True, 1, "#16181d"]


def test_the_example_of_embedding_shows_an_element_and_a_frame(new_player: NewPlayer, rich: Path) -> None:
    player = new_player({"asset": rich}, viewport={"width": 900, "height": 1200})
    player.page.goto(f"{player.address}embed.html")
    player.wait("e.ready")
    frame = player.page.frame_locator("iframe").locator("facefolds-player canvas")
    frame.wait_for()
    player.run("await new Promise((done) => setTimeout(done, 500)); e.remove()")


def test_an_element_can_change_its_source_and_go(new_player: NewPlayer, rich: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(rich, tmp_path / "other"))
    player = new_player({"asset": rich, "other": other})
    player.open("asset")
    player.run("e.setAttribute('src', '/other/')")
    player.wait("e.ready && e.level === 'full'")
    assert player.run("const p = e.player; e.remove(); await 0; return [e.player, p.closed]") == [None, True]


def test_little_script_before_the_first_picture(show: Show, player_folder: Path) -> None:
    """All that is fetched until there is a picture, compressed as servers do."""
    player = show()
    names = {urlsplit(url).path.lstrip("/") for url in player.requests if url.startswith(player.address)}
    scripts = [name for name in names if name.endswith(".js")]
    assert "draco/worker.js" in scripts
    assert sum(len(gzip.compress((player_folder / name).read_bytes())) for name in scripts) < 120_000


def test_the_modules_that_need_no_browser(project_root: Path, player_folder: Path) -> None:
    """viewer/test: node's own runner."""
    done = subprocess.run(["node", "--test"], cwd=project_root / "viewer", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
