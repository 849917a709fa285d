"""Packaging writes long takes as streams, and short ones as before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.validation import validate_asset
from facefolds_core.packaging.levels import Resampled, is_streamed, stream_unit
from facefolds_core.params import LevelParams, StreamParams
from tests.asset.filmed import filmed, packaged
from tests.viewer.fixtures import random_reflection

LEVELS = [{"name": "small", "mesh_resolution": 6, "texture_resolution": 20, "crf": 30}]


@pytest.mark.parametrize(("beyond", "streamed"), [(0.05, True), (0.2, False)])
def test_what_is_longer_than_it_may_be_in_one_piece(tmp_path: Path, beyond: float, streamed: bool) -> None:
    section = {"levels": LEVELS, "stream": {"beyond": beyond, "segment_seconds": 0.1}, "video": {"target_psnr": 38}}
    packaged(tmp_path / "asset", filmed(tmp_path / "scene"), section, random_reflection())
    assert validate_asset(tmp_path / "asset") == []
    asset = read_asset(tmp_path / "asset")
    small, full = asset.manifest.levels
    assert (asset.manifest.stream is not None) == streamed
    assert [level.texture.videos[0].segments is not None for level in (small, full)] == [streamed] * 2
    assert (small.meshes == full.meshes) == streamed
    assert full.quality is not None and full.quality.psnr_to_model > 37.5 and full.quality.target_psnr == 38
    assert small.quality is not None and small.quality.psnr_to_model > 25
    assert sum(1 for _ in asset.frames()) == 3


def test_a_still_picture_is_no_stream() -> None:
    params = StreamParams(beyond=0)
    assert not is_streamed(params, 1, 30.0) and not is_streamed(params, 1, 0.0)
    assert is_streamed(params, 2, 30.0)


@pytest.mark.parametrize(
    ("texture", "resolution", "unit"),
    [(128, 512, 4), (256, 256, 1), (128, 256, 2), (100, 256, 2), (8, 512, 8), (32, 96, 2)],
)
def test_levels_are_smaller_by_powers_of_two(texture: int, resolution: int, unit: int) -> None:
    level = LevelParams(name="small", mesh_resolution=8, texture_resolution=texture, crf=30)
    assert stream_unit([level], resolution) == unit


def test_textures_that_were_resampled_are_not_kept_without_end() -> None:
    asked: list[int] = []

    class Store:
        def image(self, layer: int, frame: int, /) -> np.ndarray:
            asked.append(frame)
            return np.full((8, 8, 4), frame, np.uint8)

    textures = Resampled(Store(), 4, most=3)
    for frame in (0, 0, 1, 2, 3, 3, 0):
        assert textures.image(0, frame).mean() == frame
    assert asked == [0, 1, 2, 3, 0]
