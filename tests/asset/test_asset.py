"""Writing and reading whole assets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.validation import validate_asset
from facefolds_core.errors import UserError
from tests.assets import PLAIN, SOURCE, WINDOW, cap_crops, cap_mesh, cap_textures, make_asset, write_asset, write_store


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_asset(tmp_path_factory.mktemp("asset") / "asset").folder


def test_meshes_come_back_bit_for_bit(folder: Path) -> None:
    asset = read_asset(folder)
    for layer, crop in zip(asset.layers, cap_crops(3, 5, 64), strict=True):  # outermost first
        for ours, theirs in zip(vars(crop.mesh).values(), vars(layer).values(), strict=True):
            assert ours.tobytes() == theirs.tobytes()


def test_textures_come_back_within_the_codecs_error(folder: Path) -> None:
    crops = cap_crops(3, 5, 64)
    for index, frame in enumerate(read_asset(folder).frames()):
        for texture, crop, whole in zip(frame, crops, cap_textures(3, index, 64), strict=True):
            truth = crop.cut(whole)
            assert texture.shape == truth.shape and texture.dtype == np.uint8
            assert np.sqrt(((texture.astype(float) - truth) ** 2).mean()) < 5  # 3 seen: H.264 finds tiny ones hard


def test_frame_k_is_frame_k(folder: Path) -> None:
    asset = read_asset(folder)
    frames = list(asset.frames())
    assert len(frames) == asset.num_frames == 5
    for index in (4, 0, 2, 3, 1):
        assert all(np.array_equal(a, b) for a, b in zip(asset.frame(index), frames[index], strict=True))
    with pytest.raises(IndexError):
        asset.frame(5)


def test_same_input_same_bytes(folder: Path, tmp_path: Path) -> None:
    make_asset(tmp_path / "asset")
    for file in folder.iterdir():
        assert (tmp_path / "asset" / file.name).read_bytes() == file.read_bytes(), file.name


@pytest.mark.parametrize("resolution", [37, 50])
def test_odd_resolutions(tmp_path: Path, resolution: int) -> None:
    frame = make_asset(tmp_path / "asset", layers=2, frames=2, resolution=resolution).frame(1)
    assert validate_asset(tmp_path / "asset") == []
    crops = cap_crops(2, 2, resolution)
    for texture, crop, whole in zip(frame, crops, cap_textures(2, 1, resolution), strict=True):
        assert np.abs(texture.astype(float) - crop.cut(whole)).mean() < 8


def test_static_scene(tmp_path: Path) -> None:
    asset = make_asset(tmp_path / "asset", frames=1, source=replace(SOURCE, fps=0.0))
    assert (asset.entry.texture.frames, asset.entry.texture.fps) == (1, 1.0)
    assert validate_asset(tmp_path / "asset") == []
    assert (len(list(asset.frames())), len(asset.frame(0))) == (1, 3)


def test_incomplete_textures_are_refused(tmp_path: Path) -> None:
    store = write_store(tmp_path / "textures.arrow", cap_textures(1, 0, 64)[None])
    with pytest.raises(UserError, match="not complete"):
        write_asset(tmp_path / "asset", [cap_mesh(0.4)] * 2, [WINDOW] * 2, store, SOURCE, PLAIN)
    assert not (tmp_path / "asset").exists()
