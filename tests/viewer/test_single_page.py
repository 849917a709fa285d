"""One HTML file with the player and an asset in it plays from the disk, and reaches for nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.asset.single_page import write_single_page
from facefolds_core.cli import app
from facefolds_core.errors import UserError
from tests.pictures import GREY, expected_means, five_cameras, psnr
from tests.streamed import streamed_asset
from tests.viewer.conftest import Player


def test_one_file_plays_from_the_disk(
    new_page: Callable[..., Page], rich: Path, player_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("facefolds_core.cli.export_html.find_player", lambda: player_folder)
    out = tmp_path / "face.html"
    done = CliRunner().invoke(app, ["export-html", str(rich), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert out.stat().st_size > sum(size for _, size, _ in read_asset(rich).manifest.full.files()[:3])
    player = Player(new_page(), out.as_uri())
    player.page.goto(f"{out.as_uri()}#frame=0")
    player.wait("e.ready && e.level === 'full'")
    player.run("e.background = v; e.effects = false", GREY)
    camera = five_cameras(160)[0]
    expected = expected_means(read_asset(rich), [camera], [0])[camera.name, 0]
    assert psnr(player.capture(camera)[..., :3], expected) >= 40
    player.run("e.play()")
    player.wait("e.frame > 0")
    assert not player.page.get_by_role("button", name="Copy a link").is_visible()  # there is no address to share
    assert {url.split(":")[0] for url in player.requests} <= {"file", "blob", "data"}
    assert [url for url in player.requests if url.startswith("file:")] == [out.as_uri()]
    assert player.said == []
    assert np.isfinite(player.capture()).all()


def test_a_player_that_was_built_before(rich: Path, tmp_path: Path) -> None:
    asset = read_asset(rich)
    with pytest.raises(UserError, match="older"):
        write_single_page(tmp_path / "face.html", rich, asset.manifest, asset.manifest.full, tmp_path)
    assert not (tmp_path / "face.html").exists()


def test_a_long_take_in_one_file(
    new_page: Callable[..., Page], player_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("facefolds_core.cli.export_html.find_player", lambda: player_folder)
    streamed_asset(tmp_path / "asset", {"stream": {"segment_seconds": 0.2}}, 14, sound=True)
    out = tmp_path / "face.html"
    done = CliRunner().invoke(app, ["export-html", str(tmp_path / "asset"), "--out", str(out)])
    assert done.exit_code == 0, done.output
    player = Player(new_page(), out.as_uri())
    player.page.goto(f"{out.as_uri()}#frame=0")
    player.wait("e.ready")
    assert player.run("return [await e.seek(13), e.frame, e.statistics.decoder]") == [True, 13, "WebCodecs"]
    assert player.said == []
