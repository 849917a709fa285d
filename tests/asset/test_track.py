"""An asset whose head moves: written, read, refused, drawn."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.asset import Asset, read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.manifest_file import SCHEMA_PATH
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.asset.validation import validate_asset
from facefolds_core.errors import UserError
from facefolds_core.geometry.torso import Torso
from facefolds_core.rendering.areas import view_of
from tests.assets import MOVING, OVER_TORSO, TORSO, TRACK, make_asset
from tests.engines.tracks import with_track
from tests.geometry.test_track import SHIFTS
from tests.gltf_files import opened
from tests.hostile.fuzz_assets import edit, put
from tests.pictures import render_asset
from tests.scenes import look_at_origin
from tests.viewer.fixtures import file_entry


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    return make_asset(tmp_path_factory.mktemp("track") / "asset", layers=2, frames=3, resolution=32, source=MOVING)


def test_the_track_comes_back_from_its_file(asset: Asset) -> None:
    assert np.array_equal(asset.track.quaternions, TRACK.quaternions.astype(np.float32))
    assert np.array_equal(asset.track.translations, TRACK.translations.astype(np.float32))
    assert (asset.folder / "track.bin").stat().st_size == 28 * 3
    assert validate_asset(asset.folder) == []


def test_the_schema_knows_it(asset: Asset) -> None:
    value = json.loads((asset.folder / "manifest.json").read_text())
    validator = jsonschema.Draft202012Validator(json.loads(SCHEMA_PATH.read_text()))
    validator.validate(value)
    for wrong in (None, "track.bin", {"file": "track.bin", "bytes": 84}, value["track_file"] | {"bytes": 0}):
        assert not validator.is_valid(value | {"track_file": wrong})


def test_a_still_head_has_no_such_key(tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=1, frames=1, resolution=32)
    assert "track_file" not in json.loads((tmp_path / "asset" / "manifest.json").read_text())


POSES = np.array([[1, 0, 0, 0, 0, 0, 0]] * 3, "<f4")


@pytest.mark.parametrize(
    ("row", "says"),
    [
        (None, "56 bytes are no poses of 28 for 3 frames"),
        ([1, 1, 0, 0, 0, 0, 0], "unit length"),
        ([1, 0, 0, 0, 0, 1e6, 0], "units away"),
        ([1, 0, 0, 0, 0, np.nan, 0], "not finite"),
    ],
)
def test_a_wrong_track_is_a_problem(asset: Asset, row: list[float] | None, says: str, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(asset.folder, tmp_path / "asset"))
    poses = POSES[:2] if row is None else np.array([*POSES[:2], row], "<f4")
    (folder / "track.bin").write_bytes(poses.tobytes())
    edit(folder, put("track_file", to=file_entry(folder / "track.bin")))
    (found,) = validate_asset(folder)
    assert says in found
    with pytest.raises(UserError, match=says):
        read_asset(folder)


def test_a_damaged_track_is_refused(asset: Asset, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(asset.folder, tmp_path / "asset"))
    content = (folder / "track.bin").read_bytes()
    (folder / "track.bin").write_bytes(bytes([content[0] ^ 1]) + content[1:])
    with pytest.raises(UserError, match="SHA-256") as caught:
        read_asset(folder)
    assert caught.value.file == folder / "track.bin"


def test_a_picture_shows_the_head_where_it_stood(asset: Asset) -> None:
    """As the camera that moved against it would see a head that stands still."""
    camera = look_at_origin("side", 25, 10, 24)
    still = replace(asset, track=None)
    moved, _ = render_asset(asset, camera, 2)
    expected, _ = render_asset(still, camera.transformed(asset.track.at(2).inverse()), 2)
    unmoved, _ = render_asset(still, camera, 2)
    assert np.array_equal(moved, expected)
    assert np.abs(moved - unmoved).max() > 0.1


def test_the_glb_has_the_pose_of_its_frame(asset: Asset, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", asset.full, "caps", frame=2)
    document, _ = opened(tmp_path / "a.glb")
    nodes = document["nodes"]
    root = nodes[document["scenes"][0]["nodes"][0]]
    (head,) = (nodes[child] for child in root["children"])
    w, x, y, z = TRACK.quaternions[2]
    assert head["rotation"] == pytest.approx([x, y, z, w])
    assert head["translation"] == pytest.approx(SHIFTS[2])
    assert [nodes[child]["mesh"] for child in head["children"]] == [0]


@pytest.fixture(scope="module")
def over_torso(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    return make_asset(tmp_path_factory.mktemp("torso") / "asset", layers=2, frames=3, resolution=32, source=OVER_TORSO)


def test_a_torso_comes_back(over_torso: Asset) -> None:
    assert over_torso.track is not None and over_torso.track.torso == TORSO
    assert validate_asset(over_torso.folder) == []


def test_a_torso_stays_in_the_room(asset: Asset) -> None:
    """As the whole does beneath the plane if it is not turned, and above it if it is."""
    turning, camera = with_track(asset.full, 20), look_at_origin("side", 25, 10, 60)
    track = replace(turning.track, torso=Torso.at([0.0, 0.0, -1.0], 0.0, 0.05, turning.track.at(0)))

    def opacity(level: AssetLevel, pose: int) -> NDArray[np.float32]:
        return view_of(level, camera, pose).composite(asset.frame(0))[1]

    over, made, whole = opacity(replace(turning, track=track), 2), opacity(turning, 0), opacity(turning, 2)
    high, low = camera.project(np.array([[0.1, 0, 0.06], [0.1, 0, -0.13]]))[0][:, 1].astype(int)
    assert np.abs(over - made)[low:].max() < 0.02 < 0.1 < np.abs(whole - made)[low:].max()
    assert np.abs(over - whole)[:high].max() < 0.02 < 0.1 < np.abs(made - whole)[:high].max()


def test_a_glb_shows_the_torso_where_it_is_in_its_frame(over_torso: Asset, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", over_torso.full, "caps", frame=2)
    document, _ = opened(tmp_path / "a.glb")
    position = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    low = np.array(document["accessors"][position]["min"])
    write_glb(tmp_path / "b.glb", replace(over_torso.full, track=None), "caps", frame=2)
    assert np.abs(low - opened(tmp_path / "b.glb")[0]["accessors"][position]["min"]).max() > 0.005


NO_TORSO = [("normal", [1, 1, 0]), ("quaternion", [2, 0, 0, 0])]


@pytest.mark.parametrize(
    "change", [*(put("torso", key, to=value) for key, value in NO_TORSO), lambda manifest: manifest.pop("track_file")]
)
def test_a_torso_that_is_none_is_a_problem(over_torso: Asset, change: Callable[[Any], object], tmp_path: Path) -> None:
    folder = Path(shutil.copytree(over_torso.folder, tmp_path / "asset"))
    edit(folder, change)
    assert any("a torso needs" in problem for problem in validate_asset(folder))
