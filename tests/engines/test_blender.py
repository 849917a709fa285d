"""The GLB, and OpenUSD, in Blender against the reference renderer."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.engines.usd import STAGE, export
from facefolds_core.rendering.reference import AssetCaster, composite, seen_from
from tests.assets import make_asset
from tests.engines.blender import REMEDY, find_blender, pictures
from tests.engines.tracks import with_track
from tests.pictures import GREY_VALUE, expected_pictures, five_cameras, lit_picture, psnr
from tests.viewer.fixtures import add_reflection

pytestmark = pytest.mark.slow

SIZE = 96
FRAME = 1
AGREE = 40.0
"""dB. Seen: 48 and more."""


@pytest.fixture(autouse=True)
def _blender() -> None:
    if find_blender() is None:
        pytest.skip(f"no Blender: {REMEDY}")


@pytest.mark.parametrize("kind", ["glb", "usd"])
def test_five_cameras_agree_with_the_reference(tmp_path: Path, kind: str) -> None:
    asset, cameras = make_asset(tmp_path / "asset", layers=4, frames=3, resolution=96), five_cameras(SIZE)
    frame = FRAME if kind == "glb" else 0  # Blender's importer of USD knows no textures sampled in time
    if kind == "glb":
        write_glb(tmp_path / "a.glb", asset.full, "caps", frame=frame)
    else:
        export(tmp_path / "usd", asset.full, "caps")
    found = pictures(tmp_path / "a.glb" if kind == "glb" else tmp_path / "usd" / STAGE, cameras, GREY_VALUE)
    expected = expected_pictures(asset, cameras, [frame])
    scores = {name: psnr(picture, expected[name, frame]) for name, picture in found.items()}
    assert min(scores.values()) >= AGREE, scores


def test_the_reflection_of_a_head_that_turned_agrees_with_the_reference(tmp_path: Path) -> None:
    """The light stays with the room."""
    make_asset(tmp_path / "asset", layers=3, frames=2, resolution=96)
    add_reflection(tmp_path / "asset")
    level, cameras = with_track(read_asset(tmp_path / "asset").full, 30), five_cameras(SIZE)[:2]
    write_glb(tmp_path / "a.glb", level, "caps", frame=1)
    found = pictures(tmp_path / "a.glb", cameras, GREY_VALUE, tmp_path / "asset")
    for camera in cameras:
        assert psnr(found[camera.name], lit_picture(level, camera, 1)) >= AGREE, camera.name


def test_the_add_on_plays_the_extensions_video(tmp_path: Path) -> None:
    """The importer with the add-on: layers in the place of the still, a frame of the movie, the head's motion."""
    level = with_track(make_asset(tmp_path / "asset", layers=4, frames=3, resolution=96).full)
    write_layered(tmp_path / "face.glb", level, "caps")
    cameras = five_cameras(SIZE)
    found = pictures(tmp_path / "face.glb", cameras, GREY_VALUE, frame=FRAME)
    caster, textures, scores = AssetCaster(level), level.frame(FRAME), {}
    for camera in cameras:
        expected = composite(caster.cast(seen_from(level, camera, FRAME)), textures, (GREY_VALUE,) * 3)[0]
        scores[camera.name] = psnr(found[camera.name], expected)
    assert min(scores.values()) >= AGREE, scores
