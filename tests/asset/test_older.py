"""Assets of older format versions are read as they were."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.manifest_file import parse_manifest
from facefolds_core.asset.validation import validate_asset
from facefolds_core.errors import UserError
from tests.assets import make_asset
from tests.older import make_older
from tests.viewer.fixtures import rich_asset


@pytest.mark.parametrize("version", [1, 2])
def test_an_older_asset_is_sound_and_shows_the_same(tmp_path: Path, version: int) -> None:
    folder = tmp_path / "asset"
    make_asset(folder)
    today = read_asset(folder)
    frame, meshes = today.frame(3), today.layers
    make_older(folder, version)
    assert validate_asset(folder) == []
    older = read_asset(folder)
    assert all(np.array_equal(a, b) for a, b in zip(frame, older.frame(3), strict=True))
    assert all(a.vertices.tobytes() == b.vertices.tobytes() for a, b in zip(meshes, older.layers, strict=True))
    assert older.manifest.full.texture.rate == today.manifest.full.texture.rate


def test_all_that_version_2_knew(tmp_path: Path) -> None:
    folder = rich_asset(tmp_path / "asset")
    before = parse_manifest(folder / "manifest.json")
    make_older(folder, 2)
    assert validate_asset(folder) == []
    found = parse_manifest(folder / "manifest.json")
    assert (found.poster, found.photos, found.audio) == (before.poster, before.photos, before.audio)
    assert [level.texture.videos for level in found.levels] == [level.texture.videos for level in before.levels]


@pytest.mark.parametrize(
    "change",
    [{"levels": [1]}, {"levels": None}, {"levels": [{"texture": {"fps": 1e-300}}]}, {"version": 1, "layers": 3}],
)
def test_nonsense_of_an_older_version_is_no_traceback(tmp_path: Path, change: dict[str, object]) -> None:
    make_asset(tmp_path / "asset", frames=1)
    path = make_older(tmp_path / "asset", 2) / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(UserError):
        parse_manifest(path)
