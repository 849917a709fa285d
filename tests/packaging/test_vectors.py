"""The conformance vectors are sound, hard where players go wrong, and agree with players that were written apart."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from facefolds_core.asset import read_asset
from facefolds_core.asset.gltf.checking import check_glb
from facefolds_core.asset.validation import validate_asset
from tests.asset.independent_reader import Player
from tests.vectors import ASSETS, BACKGROUND, compare, main, write_vectors


def test_the_assets_are_sound(vectors: Path) -> None:
    assert [validate_asset(vectors / name) for name in ASSETS] == [[], []]
    assert read_asset(vectors / "stream").manifest.stream is not None
    assert check_glb(vectors / "short.glb") == []


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
    frames = {"full": 0, "small": 2}
    for view in (view for view in views if view["asset"] == "short" and view["frame"] == frames[view["level"]]):
        player = Player(vectors / "short", 0 if view["level"] == "small" else -1)
        side = view["width"]
        places = np.arange(side // 4, 3 * side // 4, max(1, side // 42))
        pixels = np.stack(np.meshgrid(places, places), -1).reshape(-1, 2)
        offsets = np.stack(np.meshgrid((0.25, 0.75), (0.25, 0.75)), -1).reshape(-1, 2)
        quarters = [_shown(player, vectors, view, pixels + offset) for offset in offsets]
        points = _shown(player, vectors, view, pixels + 0.5)
        for folder, found in (("reference", np.mean(quarters, 0)), ("reference_points", points)):
            truth = np.asarray(Image.open(vectors / folder / view["file"]), float) / 255
            error = found - truth[pixels[:, 1], pixels[:, 0]]
            assert 10 * np.log10(1 / (error**2).mean()) > 50, (folder, view["file"])


def _shown(player: Player, vectors: Path, view: dict, pixels: np.ndarray) -> np.ndarray:
    """What the rays through these places of the picture (M, 2) see: (M, 3)."""
    poses = np.fromfile(vectors / "short" / "track.bin", "<f4").reshape(-1, 7)
    w, x, y, z, *translation = poses[view["frame"]].astype(float)
    R = Rotation.from_quat([x, y, z, w]).as_matrix()
    w2c = np.array(view["w2c"])
    seen = np.concatenate([w2c[:, :3] @ R, (w2c[:, :3] @ translation + w2c[:, 3])[:, None]], 1)
    look, picture = player.look(np.array(view["K"]), seen, pixels), player.pictures()[view["frame"]]
    return player.render(picture, look) + _through(player, picture, look)[:, None] * np.array(BACKGROUND)


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
    noisy = np.asarray(Image.open(mine / names[2]), int)
    noisy = noisy + np.random.default_rng(0).integers(-9, 10, noisy.shape)
    Image.fromarray(np.clip(noisy, 0, 255).astype(np.uint8)).save(mine / names[2])
    found = {name: means for name, (means, _) in compare(vectors, mine).items()}
    assert (found[names[0]], found[names[1]]) == (0, 0)
    assert 30 < found[names[2]] < 35
    assert {found[name] for name in names[3:]} == {99.0}


def test_views_tell_one_ray_a_pixel_from_means(vectors: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = compare(vectors, vectors / "reference_points")
    coarse = [means for name, (means, _) in found.items() if "coarse" in name]
    # Seen: 31.5 to 36.1 dB where a pixel holds several texels. 4 x 4 rays instead of 2 x 2: 44.4 and more.
    assert len(coarse) == 12 and max(coarse) < 38
    assert {points for _, points in found.values()} == {99.0}
    with pytest.MonkeyPatch.context() as patched, pytest.raises(SystemExit) as ended:
        patched.setattr("sys.argv", ["vectors", str(vectors), "--check", str(vectors / "reference_points")])
        main()
    assert ended.value.code == 1
    assert f"{len(found) - 12} of {len(found)} reach 40 dB" in capsys.readouterr().out


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(SystemExit, match="name another folder"):
        write_vectors(tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"
