"""One HTML file with the player and an asset in it plays from the disk, and reaches for nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.asset.single_page import write_single_page
from facefolds_core.cli import app
from facefolds_core.errors import UserError
from tests.pictures import GREY, expected_pictures, five_cameras, psnr
from tests.streamed import streamed_asset
from tests.viewer.conftest import Player


@pytest.fixture
def exported(
    new_page: Callable[..., Page], player_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[Path], Player]]:
    """A page with an asset in it, opened from the disk; it says nothing on its console."""
    monkeypatch.setattr("facefolds_core.cli.export_html.find_player", lambda: player_folder)
    out, players = tmp_path / "face.html", list[Player]()

    def of(asset: Path) -> Player:
        done = CliRunner().invoke(app, ["export-html", str(asset), "--out", str(out)])
        assert done.exit_code == 0, done.output
        players.append(Player(new_page(), out.as_uri()))
        players[0].page.goto(f"{out.as_uri()}#frame=0")
        players[0].wait("e.ready && e.level === 'full'")
        return players[0]

    yield of
    assert players[0].said == []


def test_one_file_plays_from_the_disk(exported: Callable[[Path], Player], rich: Path, tmp_path: Path) -> None:
    player, out = exported(rich), tmp_path / "face.html"
    assert out.stat().st_size > sum(size for _, size, _ in read_asset(rich).manifest.full.files()[:3])
    player.run("e.background = v; e.effects = false", GREY)
    camera = five_cameras(160)[0]
    expected = expected_pictures(read_asset(rich), [camera], [0], means=True)[camera.name, 0]
    assert psnr(player.capture(camera)[..., :3], expected) >= 40
    player.run("e.play()")
    player.wait("e.frame > 0")
    assert not player.page.get_by_role("button", name="Copy a link").is_visible()  # there is no address to share
    assert {url.split(":")[0] for url in player.requests} <= {"file", "blob", "data"}
    assert [url for url in player.requests if url.startswith("file:")] == [out.as_uri()]


def test_a_player_that_was_built_before(rich: Path, tmp_path: Path) -> None:
    asset = read_asset(rich)
    with pytest.raises(UserError, match="older"):
        write_single_page(tmp_path / "face.html", rich, asset.manifest, asset.manifest.full, tmp_path)
    assert not (tmp_path / "face.html").exists()


def test_a_long_take_in_one_file(exported: Callable[[Path], Player], tmp_path: Path) -> None:
    streamed_asset(tmp_path / "asset", {"stream": {"segment_seconds": 0.2}}, 14, sound=True)
    player = exported(tmp_path / "asset")
    assert player.run("return [await e.seek(13), e.frame, e.statistics.decoder]") == [True, 13, "WebCodecs"]
