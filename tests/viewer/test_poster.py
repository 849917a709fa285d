"""The poster and the first picture: the same face at the same place, in front of the same colour."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset import read_asset
from facefolds_core.packaging.poster import BACKGROUND, FIELD_OF_VIEW, FILLED, write_poster
from tests.assets import make_asset
from tests.pictures import psnr
from tests.scenes import view_of
from tests.viewer.conftest import NewPlayer, Player
from tests.viewer.fixtures import add_reflection, change_manifest, file_entry

BARE = """const root = e.shadowRoot;
for (const name of ['.spinner', 'header', '.bar', '.toast']) root.querySelector(name).style.visibility = 'hidden';
root.querySelector('.poster').style.transition = 'none';"""
AGREE = 42.0
"""dB. Seen: 47.7 and more: the poster is scaled, and a JPEG."""


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_asset(tmp_path_factory.mktemp("poster") / "asset", layers=3, frames=2, resolution=96).folder
    add_reflection(folder)
    made = read_asset(folder)
    camera = write_poster(folder / "poster.jpg", made, made.manifest.bounds, 640)
    poster = file_entry(folder / "poster.jpg") | view_of(camera) | {"background": list(BACKGROUND)}
    change_manifest(folder, lambda value: value.update(poster=poster))
    return folder


def seen(player: Player) -> NDArray[np.float64]:
    player.run(BARE)
    data = player.page.screenshot(animations="disabled")
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")) / 255


def waiting(new_player: NewPlayer, asset: Path, view: str, **options: object) -> tuple[Player, Callable[[], None]]:
    """A player whose video is held back, and what lets go of it."""
    player = new_player({"asset": asset}, **options)
    release = player.hold("**/*.mp4")
    player.open("asset", view, wait=False)
    return player, release


@pytest.mark.parametrize(
    "size", [(390, 844), *(pytest.param(size, marks=pytest.mark.nightly) for size in ((900, 600), (360, 240)))]
)
def test_the_first_picture_is_the_poster(new_player: NewPlayer, asset: Path, size: tuple[int, int]) -> None:
    viewport = {"width": size[0], "height": size[1]}
    player, release = waiting(new_player, asset, "frame=0", viewport=viewport)
    player.page.locator(".poster").wait_for()
    before = seen(player)
    assert player.run("return e.ready") is False
    release()
    player.wait("e.ready")
    after = seen(player)
    assert np.ptp(before, axis=(0, 1)).max() > 0.3  # there is something to be seen
    assert psnr(before, after) >= AGREE


@pytest.mark.parametrize(
    "view",
    [
        "view=30,0,1.2,0,0,0",
        "hidden=1",
        *(pytest.param(view, marks=pytest.mark.nightly) for view in ("background=ffffff", "mode=alpha")),
    ],
)
def test_a_poster_that_shows_something_else_is_not_shown(new_player: NewPlayer, asset: Path, view: str) -> None:
    player, release = waiting(new_player, asset, view)
    player.page.wait_for_timeout(300)
    assert not player.page.locator(".poster").is_visible()
    release()
    player.wait("e.ready")


def test_both_know_of_the_same_camera_and_colour(project_root: Path) -> None:
    def said(file: str, pattern: str) -> str:
        found = re.search(pattern, (project_root / "viewer" / "src" / file).read_text())
        assert found is not None, pattern
        return found[1]

    assert float(said("attributes.js", r"FIELD_OF_VIEW = ([\d.]+)")) == FIELD_OF_VIEW
    assert float(said("view.js", r"FILLED = ([\d.]+)")) == FILLED
    colour = bytes.fromhex(said("element.js", r'BACKGROUND = "#(\w{6})"'))
    assert [round(255 * value) for value in BACKGROUND] == list(colour)
