"""An asset whose head moves: written, read, refused, drawn."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from facefolds_core.asset import Asset, read_asset
from facefolds_core.asset.checks import manifest_problems
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.manifest import Manifest
from facefolds_core.asset.manifest_extras import Pose
from facefolds_core.asset.manifest_file import SCHEMA_PATH
from facefolds_core.errors import UserError
from facefolds_core.geometry.track import Track
from facefolds_core.rendering import render_asset
from tests.asset.test_glb import opened
from tests.assets import SOURCE, make_asset
from tests.geometry.test_track import SHIFTS, TURNS
from tests.scenes import look_at_origin

TRACK = Track.of(TURNS, SHIFTS)


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    folder = tmp_path_factory.mktemp("track") / "asset"
    make_asset(folder, layers=2, frames=3, resolution=32, source=replace(SOURCE, track=TRACK))
    return read_asset(folder)


def test_the_track_comes_back_exactly(asset: Asset) -> None:
    assert asset.track is not None
    assert np.array_equal(asset.track.quaternions, TRACK.quaternions)
    assert np.array_equal(asset.track.translations, TRACK.translations)


def test_the_schema_knows_it(asset: Asset) -> None:
    value = json.loads((asset.folder / "manifest.json").read_text())
    validator = jsonschema.Draft202012Validator(json.loads(SCHEMA_PATH.read_text()))
    validator.validate(value)
    for wrong in (None, [{"quaternion": [1, 0, 0], "translation": [0, 0, 0]}], [{"quaternion": [1, 0, 0, 0]}]):
        assert not validator.is_valid(value | {"track": wrong})


def test_a_still_head_has_no_such_key(tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=1, frames=1, resolution=32)
    assert "track" not in json.loads((tmp_path / "asset" / "manifest.json").read_text())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda poses: poses[:2], "2 frames|frames"),
        (lambda poses: (*poses[:2], Pose(quaternion=(1, 1, 0, 0), translation=(0, 0, 0))), "unit length"),
        (lambda poses: (*poses[:2], Pose(quaternion=(1, 0, 0, 0), translation=(0, 1e6, 0))), "units away"),
    ],
)
def test_a_wrong_track_is_a_problem(asset: Asset, change: object, says: str) -> None:
    manifest: Manifest = asset.manifest.model_copy(update={"track": change(asset.manifest.track)})  # type: ignore[operator]
    path = asset.folder / "manifest.json"
    assert manifest_problems(path, asset.manifest) == []
    (found,) = manifest_problems(path, manifest)
    assert any(word in found for word in says.split("|"))


def test_a_damaged_track_is_refused(asset: Asset, tmp_path: Path) -> None:
    path = asset.folder / "manifest.json"
    text = path.read_text()
    try:
        path.write_text(text.replace('"quaternion"', '"quaternoin"', 1))
        with pytest.raises(UserError):
            read_asset(asset.folder)
    finally:
        path.write_text(text)


def test_a_picture_shows_the_head_where_it_stood(asset: Asset) -> None:
    """As the camera that moved against it would see a head that stands still."""
    camera = look_at_origin("side", 25, 10, 24)
    still = replace(asset, levels=tuple(replace(level, track=None) for level in asset.levels))
    moved, _ = render_asset(asset, camera, 2)
    expected, _ = render_asset(still, camera.transformed(TRACK.at(2).inverse()), 2)
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
    assert sorted(head["children"]) == [0, 1]
