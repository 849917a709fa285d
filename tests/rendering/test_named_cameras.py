"""Cameras that `facefolds render --camera` finds: of the poster, of photos, of the scene beside the asset, in files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import Scene
from facefolds_core.cli.render import named_camera
from facefolds_core.errors import UserError
from tests.asset.filmed import HELD_OUT, filmed, packaged


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scene]:
    """An asset with poster and photos beside its scene."""
    root = tmp_path_factory.mktemp("subject")
    scene = filmed(root / "scene")
    packaged(root / "asset", scene, {"photos": 1})
    return root / "asset", scene


def test_cameras_by_name(made: tuple[Path, Scene]) -> None:
    asset, scene = read_asset(made[0]), made[1]
    poster = named_camera(asset, "poster")
    assert asset.manifest.poster is not None and poster.width == asset.manifest.poster.width
    for index in (HELD_OUT, 0):
        found, camera = named_camera(asset, scene.cameras[index].name), scene.cameras[index]
        np.testing.assert_array_equal(found.w2c, camera.w2c)
        np.testing.assert_array_equal(found.K, camera.K)
    with pytest.raises(UserError, match="no such camera") as caught:
        named_camera(asset, "nobody")
    assert "poster, c8, c0, c1" in str(caught.value.expected)


def test_without_a_scene_the_assets_own(made: tuple[Path, Scene], tmp_path: Path) -> None:
    (tmp_path / "asset").symlink_to(made[0])
    (alone := tmp_path / "copy").mkdir()
    for path in made[0].iterdir():
        (alone / path.name).write_bytes(path.read_bytes())
    with pytest.raises(UserError) as caught:
        named_camera(read_asset(alone), "c0")
    assert caught.value.expected == "poster, c8"
    assert named_camera(read_asset(tmp_path / "asset"), "c0").name == "c0"


VIEW: dict[str, Any] = {
    "K": [[50, 0, 20], [0, 60, 15], [0, 0, 1]],
    "w2c": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2]],
    "width": 40,
    "height": 30,
}


def test_a_camera_from_a_file(made: tuple[Path, Scene], tmp_path: Path) -> None:
    path = tmp_path / "view.json"
    path.write_text(json.dumps(VIEW | {"more": "is passed over"}))
    camera = named_camera(read_asset(made[0]), str(path))
    assert (camera.width, camera.height) == (40, 30)


@pytest.mark.parametrize(
    "change",
    [{"K": 1}, {"w2c": [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2]]}, {"width": 0}, {"height": "x"}, {"K": [[1]]}],
)
def test_a_file_without_a_camera(made: tuple[Path, Scene], tmp_path: Path, change: dict[str, Any]) -> None:
    path = tmp_path / "view.json"
    path.write_text(json.dumps(VIEW | change))
    with pytest.raises(UserError, match="no camera in the file"):
        named_camera(read_asset(made[0]), str(path))
