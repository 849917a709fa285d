"""The reflection of an asset: from the model's maps to the file, and back to what a player adds."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from facefolds_core.asset import Asset, read_asset
from facefolds_core.asset.reflection import pack_reflection
from facefolds_core.asset.validation import validate_asset
from facefolds_core.export.stores import read_places
from facefolds_core.geometry.sphere_uv import st_to_uv, uv_to_st
from facefolds_core.model.reflection import Reflection, ReflectionShape
from facefolds_core.rendering.reference import AssetCaster
from facefolds_core.rendering.reflection import reflected_colours
from tests.assets import make_asset
from tests.scenes import look_at_origin
from tests.viewer.fixtures import add_reflection, change_manifest, random_reflection


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    folder = tmp_path_factory.mktemp("glossy") / "asset"
    make_asset(folder, layers=2, frames=1, resolution=48)
    add_reflection(folder)
    return read_asset(folder)


def test_the_file_holds_the_maps_to_half_a_code(asset: Asset) -> None:
    maps, found = random_reflection(), asset.full.reflection()
    for name, largest in (("gloss", 1.0), ("offset", 0.6), ("environment", 1.0), ("normals", 2.0)):
        np.testing.assert_allclose(getattr(found, name), getattr(maps, name), atol=0.51 * largest / 255, err_msg=name)
    assert found.window == maps.window


def test_what_a_player_adds_is_what_the_model_adds(asset: Asset) -> None:
    """The layers' windows are not the maps'."""
    maps = asset.full.reflection()
    model = Reflection(ReflectionShape((6, 5), 9))
    with torch.no_grad():
        for name in ("gloss", "offset", "normals", "environment"):
            getattr(model, name).copy_(torch.from_numpy(getattr(maps, name)))
    camera = look_at_origin("camera", 20, 10, 60)
    hits = AssetCaster(asset).cast(camera)
    found = reflected_colours(hits, camera, asset.full.windows, maps)
    for layer, window in enumerate(asset.full.windows):
        hit = hits.hit[..., layer]
        st = uv_to_st(st_to_uv(hits.st[..., layer, :][hit].astype(np.float64), window), maps.window)
        along = camera.rays()[1][hit]
        expected = model.added(torch.from_numpy(st).float(), torch.from_numpy(along).float()).detach().numpy()
        np.testing.assert_allclose(found[layer], expected, atol=1e-4)
        assert np.abs(expected).max() > 0.1


def test_a_rotation_to_the_room_turns_the_light(asset: Asset) -> None:
    """Half a turn about x is half a turn of the environment's picture."""
    maps, camera = random_reflection(), look_at_origin("camera", 20, 10, 60)
    hits, windows = AssetCaster(asset).cast(camera), asset.full.windows
    turned = reflected_colours(hits, camera, windows, maps, np.diag([1.0, -1.0, -1.0]))
    upside_down = type(maps)(**{**vars(maps), "environment": maps.environment[::-1, ::-1].copy()})
    expected = reflected_colours(hits, camera, windows, upside_down)
    for one, other in zip(turned, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_a_rectangle_beside_the_picture_is_refused(asset: Asset, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(asset.folder, tmp_path / "asset"))
    change_manifest(folder, lambda value: value["levels"][-1]["reflection"].update(gloss_rect=[0, 1000, 5, 6]))
    assert any("not inside the reflection's picture" in problem for problem in validate_asset(folder))


def test_an_empty_reflection_can_be_stored() -> None:
    maps = random_reflection()
    blank = type(maps)(**{**vars(maps), "gloss": 0 * maps.gloss, "environment": 0 * maps.environment})
    assert all(value > 0 for key, value in pack_reflection(blank)[1].items() if key.endswith("_scale"))


def test_grids_keep_the_reflection_where_there_is_one(tmp_path: Path) -> None:
    path, maps = tmp_path / "grids.npz", random_reflection()
    places = {"windows": np.array([[-1.0, 1, -1, 1]]), "centre": np.zeros(3)}
    np.savez(path, **places)
    assert read_places(path)[2] is None
    np.savez(path, **places, **{f"reflection_{name}": np.asarray(value) for name, value in vars(maps).items()})
    found = read_places(path)[2]
    assert found.window == maps.window
    np.testing.assert_array_equal(found.environment, maps.environment)
