"""The conformance vectors are sound, hard where players go wrong, and agree with players that were written apart."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.asset.validation import validate_asset
from facefolds_core.cli import app
from facefolds_core.packaging.vectors import ASSETS, BACKGROUND, compare, write_vectors
from tests.asset.independent_reader import Player


@pytest.fixture(scope="module")
def vectors(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "vectors"
    assert write_vectors(folder) == len(list((folder / "reference").iterdir()))
    return folder


def test_the_assets_are_sound(vectors: Path) -> None:
    assert [validate_asset(vectors / name) for name in ASSETS] == [[], []]
    assert read_asset(vectors / "stream").manifest.stream is not None


def test_sheets_fold_before_the_eye(vectors: Path) -> None:
    """From the side some triangles are seen from behind: without depth they would be drawn over others."""
    view = next(view for view in json.loads((vectors / "views.json").read_text())["views"] if view["camera"] == "left")
    w2c = np.array(view["w2c"])
    eye = -w2c[:, :3].T @ w2c[:, 3]
    for mesh in read_asset(vectors / "short").layers:
        a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
        facing = (np.cross(b - a, c - a) * (eye - a)).sum(1) > 0
        assert 0.05 < facing.mean() < 0.95


def test_a_player_written_from_the_document_agrees(vectors: Path) -> None:
    views = json.loads((vectors / "views.json").read_text())["views"]
    for view in (view for view in views if view["asset"] == "short" and view["frame"] in (0, 2)):
        player = Player(vectors / "short", 0 if view["level"] == "small" else -1)
        poses = np.fromfile(vectors / "short" / "track.bin", "<f4").reshape(-1, 7)
        w, x, y, z, *translation = poses[view["frame"]].astype(float)
        R = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        w2c = np.array(view["w2c"])
        seen = np.concatenate([w2c[:, :3] @ R, (w2c[:, :3] @ translation + w2c[:, 3])[:, None]], 1)
        rows, columns = np.mgrid[40:90:3, 30:100:3]
        pixels = np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], -1)
        look = player.look(np.array(view["K"]), seen, pixels)
        picture = player.pictures()[view["frame"]]
        shown = player.render(picture, look) + _through(player, picture, look)[:, None] * np.array(BACKGROUND)
        truth = np.asarray(Image.open(vectors / "reference" / view["file"]), float) / 255
        error = shown - truth[rows.ravel(), columns.ravel()]
        assert 10 * np.log10(1 / (error**2).mean()) > 50, view["file"]


def _through(player: Player, picture: np.ndarray, look: tuple) -> np.ndarray:
    """What of the background shows: the difference of the same picture over white and over black layers."""
    white = picture.copy()
    white[..., :3] = 1
    return 1 - player.render(white, look)[:, 0]


def test_pictures_are_compared_one_by_one(vectors: Path, tmp_path: Path) -> None:
    mine = Path(shutil.copytree(vectors / "reference", tmp_path / "mine"))
    names = sorted(path.name for path in mine.iterdir())
    (mine / names[0]).unlink()
    Image.new("RGB", (4, 4)).save(mine / names[1])
    noisy = np.asarray(Image.open(mine / names[2]), int) + np.random.default_rng(0).integers(-9, 10, (128, 128, 3))
    Image.fromarray(np.clip(noisy, 0, 255).astype(np.uint8)).save(mine / names[2])
    found = {one.file: one.psnr for one in compare(vectors, mine)}
    assert found[names[0]] is None and found[names[1]] is None
    assert 30 < (found[names[2]] or 0) < 35
    assert {found[name] for name in names[3:]} == {99.0}
    done = CliRunner().invoke(app, ["vectors", str(vectors), "--check", str(mine)])
    assert done.exit_code == 1 and f"{len(names) - 3} of {len(names)} reach 40 dB" in done.output


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    done = CliRunner().invoke(app, ["vectors", str(tmp_path)])
    assert done.exit_code == 1 and (tmp_path / "notes.txt").read_text() == "mine"
    done = CliRunner().invoke(app, ["vectors", str(tmp_path), "--check", str(tmp_path)])
    assert done.exit_code == 1 and "no conformance vectors" in done.output
