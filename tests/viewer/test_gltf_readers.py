"""Readers of EXT_layered_volumetric_video in Chromium, five views against the reference renderer."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from facefolds_core.asset import Asset
from facefolds_core.asset.glb import container
from facefolds_core.asset.gltf.extension import NAME
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.cli.export import export
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.pixels import render
from tests.assets import MOVING, OVER_TORSO, make_asset
from tests.gltf_files import opened
from tests.pictures import GREY_VALUE, expected_pictures, five_cameras, psnr
from tests.viewer.fixtures import moving_asset
from tests.viewer.gltf_viewers import GltfViewer, build, page_with, pictures

SIZE, FRAME = 96, 2
AGREE = 50.0
"""dB, of means over pixels. Seen: 56 and more."""


@pytest.fixture(scope="module", params=["layered_three", "layered_babylon"])
def reader(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, player_folder: Path) -> Path:
    name: GltfViewer = request.param
    folder = tmp_path_factory.mktemp(name)
    build(folder, name)
    shutil.copytree(player_folder / "draco", folder / "draco")
    return folder


@pytest.fixture(scope="module")
def face(tmp_path_factory: pytest.TempPathFactory) -> tuple[Asset, Path]:
    """An asset, and its GLB."""
    asset = make_asset(tmp_path_factory.mktemp("face") / "asset", layers=4, frames=3, resolution=96)
    return asset, exported(asset)


@pytest.fixture(scope="module", params=[MOVING, OVER_TORSO], ids=["whole", "over a torso"])
def moving(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Asset, Path]:
    """Of a head that moves in the light of its room."""
    asset = moving_asset(tmp_path_factory.mktemp("moving") / "asset", request.param, layers=4, resolution=96)
    return asset, exported(asset)


def exported(asset: Asset) -> Path:
    write_layered(asset.folder.with_suffix(".glb"), asset.full, "caps")
    return asset.folder.with_suffix(".glb")


def shown(browser: Browser, reader: Path, glb: Path, cameras: Sequence[Camera]) -> dict[str, NDArray[np.float64]]:
    """Means over pixels: drawn at twice the size."""
    fine = [Camera(c.name, np.diag([2.0, 2, 1]) @ c.K, c.w2c, 2 * c.width, 2 * c.height) for c in cameras]
    found = pictures(browser, reader, glb, fine, FRAME)
    return {name: picture.reshape(SIZE, 2, SIZE, 2, 3).mean((1, 3)) for name, picture in found.items()}


def test_five_views_agree_with_the_reference(browser: Browser, reader: Path, face: tuple[Asset, Path]) -> None:
    asset, glb = face
    cameras = five_cameras(SIZE)
    found, expected = shown(browser, reader, glb, cameras), expected_pictures(asset, cameras, [FRAME], means=True)
    scores = {name: psnr(picture, expected[name, FRAME]) for name, picture in found.items()}
    assert len(scores) == 5 and min(scores.values()) >= AGREE, scores


def test_a_head_that_moves_in_the_light_of_its_room(browser: Browser, reader: Path, moving: tuple[Asset, Path]) -> None:
    asset, glb = moving
    cameras = five_cameras(SIZE)[:2]
    for name, picture in shown(browser, reader, glb, cameras).items():
        camera = next(camera for camera in cameras if camera.name == name)
        expected, _ = render(asset, camera, FRAME, (GREY_VALUE,) * 3)
        assert psnr(picture, expected) >= AGREE, name


def test_the_video_plays(browser: Browser, reader: Path, face: tuple[Asset, Path]) -> None:
    with page_with(browser, reader, face[1]) as page:
        assert sorted(page.evaluate("play('head.glb')")) == [0, 1, 2]


def test_its_sound_is_heard_with_it(browser: Browser, reader: Path, rich: Path, tmp_path: Path) -> None:
    export("gltf", rich, tmp_path / "face.glb", None)
    with page_with(browser, reader, tmp_path / "face.glb") as page:
        assert page.evaluate("sound('head.glb')") > 0


@pytest.mark.parametrize(("sums", "words"), [(False, "no video can be decoded"), (True, "is damaged")])
def test_a_damaged_video_leaves_the_still(
    browser: Browser, reader: Path, face: tuple[Asset, Path], tmp_path: Path, sums: bool, words: str
) -> None:
    document, binary = opened(face[1])
    view = document["bufferViews"][document["extensions"]["KHR_texture_video"]["videos"][0]["bufferView"]]
    start = view["byteOffset"]
    if not sums:
        del document["nodes"][0]["extensions"][NAME]["checksums"]
    damaged = container(document, binary[:start] + bytes(view["byteLength"]))
    (tmp_path / "damaged.glb").write_bytes(damaged)
    with page_with(browser, reader, tmp_path / "damaged.glb") as page:
        found = page.evaluate("fallback('head.glb')")
    assert found["videos"] == 0 and found["meshes"] == 2
    assert words in found["said"][0]
