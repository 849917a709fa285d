"""The GLB, and OpenUSD, in Blender against the reference renderer."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.engines.usd import STAGE, write_usd
from tests.assets import make_asset
from tests.engines.blender import REMEDY, find_blender, pictures
from tests.pictures import GREY_VALUE, expected_pictures, five_cameras, psnr

pytestmark = pytest.mark.slow

SIZE = 96
FRAME = 1
AGREE = 40.0
"""dB. Seen: 48 and more."""


@pytest.mark.parametrize("draco", [False, True])
def test_five_cameras_agree_with_the_reference(tmp_path: Path, draco: bool) -> None:
    if find_blender() is None:
        pytest.skip(f"no Blender: {REMEDY}")
    make_asset(tmp_path / "asset", layers=4, frames=3, resolution=96)
    asset, cameras = read_asset(tmp_path / "asset"), five_cameras(SIZE)
    write_glb(tmp_path / "a.glb", asset.full, "caps", frame=FRAME, draco=draco)
    found = pictures(tmp_path / "a.glb", cameras, GREY_VALUE)
    expected = expected_pictures(asset, cameras, [FRAME])
    scores = {name: psnr(picture, expected[name, FRAME]) for name, picture in found.items()}
    assert min(scores.values()) >= AGREE, scores


def test_five_cameras_of_usd_agree_with_the_reference(tmp_path: Path) -> None:
    if find_blender() is None:
        pytest.skip(f"no Blender: {REMEDY}")
    make_asset(tmp_path / "asset", layers=4, frames=2, resolution=96)
    asset, cameras = read_asset(tmp_path / "asset"), five_cameras(SIZE)
    write_usd(tmp_path / "usd", asset.full, "caps")
    found = pictures(tmp_path / "usd" / STAGE, cameras, GREY_VALUE)
    expected = expected_pictures(asset, cameras, [0])  # Blender's importer knows no textures sampled in time
    scores = {name: psnr(picture, expected[name, 0]) for name, picture in found.items()}
    assert min(scores.values()) >= AGREE, scores
