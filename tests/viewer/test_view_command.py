"""`facefolds view`: which asset it takes, and what it says when it cannot."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from urllib.parse import urljoin

import pytest
from playwright.sync_api import Page

from facefolds_core.cli.view import asset_folder, latest_asset
from facefolds_core.errors import UserError
from facefolds_core.serving.player import find_player
from tests.assets import make_asset
from tests.viewer.conftest import ELEMENT, PATIENCE, listening


def test_the_asset_made_last_is_taken_and_what_is_not_there_is_made_by_a_command(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="make repro"):
        latest_asset(tmp_path)
    with pytest.raises(UserError, match="make view"):
        find_player((tmp_path,))
    for age, name in enumerate(("new", "old")):
        manifest = tmp_path / name / "asset" / "manifest.json"
        manifest.parent.mkdir(parents=True)
        manifest.write_text("{}")
        os.utime(manifest, (1000 - age, 1000 - age))
    assert latest_asset(tmp_path) == tmp_path / "new" / "asset"


@pytest.mark.parametrize("name", ["asset", "asset/manifest.json", "asset.glb", "."])
def test_what_lies_in_an_asset_or_beside_it_names_it(tmp_path: Path, name: str) -> None:
    (tmp_path / "asset").mkdir()
    for file in ("asset/manifest.json", "asset.glb"):
        (tmp_path / file).write_text("{}")
    assert asset_folder(tmp_path / name) == tmp_path / "asset"


@pytest.mark.parametrize(("name", "said"), [("still.glb", "viewers of glTF"), ("nowhere/manifest.json", "data/actor")])
def test_what_names_no_asset_is_told_what_does(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "still.glb").touch()
    with pytest.raises(UserError, match=said):
        asset_folder(tmp_path / name)


@contextmanager
def viewing(*words: str, within: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The command, started: the address that it names, and its process."""
    command = [sys.executable, "-m", "facefolds_core", "view", *words, "--no-browser"]
    # A shell's background jobs ignore SIGINT, and their children inherit that.
    restore = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, cwd=within, stdout=subprocess.PIPE, text=True, preexec_fn=restore) as process:
        try:
            assert process.stdout
            lines = process.stdout.readline() + process.stdout.readline()
            address = re.search(r"http://\S+", lines)
            assert address
            yield address[0], process
        finally:
            process.send_signal(signal.SIGINT)


def test_it_serves_until_it_is_interrupted(tmp_path: Path, player_folder: Path, project_root: Path) -> None:
    make_asset(tmp_path / "some" / "asset", layers=1, frames=1, resolution=32)
    with viewing("--data", str(tmp_path), within=project_root) as (address, process):
        for path in ("", "asset/manifest.json"):
            with urllib.request.urlopen(urljoin(address, path), timeout=10) as response:
                assert response.status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 0


@pytest.mark.parametrize("name", ["asset.glb", "asset/manifest.json"])
def test_what_it_serves_is_shown(
    tmp_path: Path, rich: Path, player_folder: Path, project_root: Path, new_page: Callable[..., Page], name: str
) -> None:
    (tmp_path / "asset").symlink_to(rich)
    (tmp_path / "asset.glb").touch()
    page = new_page()
    said, _ = listening(page)
    with viewing(str(tmp_path / name), within=project_root) as (address, _):
        page.goto(address)
        page.wait_for_function(f"() => {ELEMENT}?.ready", timeout=PATIENCE)
        assert page.evaluate(f"() => {ELEMENT}.getAttribute('folder')") == str(tmp_path / "asset")  # for commands
    assert said == []
