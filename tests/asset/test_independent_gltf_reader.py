"""The extension's text is enough: a reader written from it alone sees what the reference renderer sees."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from facefolds_core.asset import Asset
from facefolds_core.asset.gltf.checking import check_glb
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.rendering.pixels import render
from tests.asset.independent_gltf_reader import Face
from tests.assets import MOVING, OVER_TORSO
from tests.pictures import GREY_VALUE, five_cameras, psnr
from tests.vectors import BACKGROUND, EXAMPLE, VIEWS, shown_by_example
from tests.viewer.fixtures import moving_asset

pytestmark = pytest.mark.slow

KEPT = Path(__file__).parents[2] / "docs/reference/EXT_layered_volumetric_video/examples"
SIZE, FRAME = 24, 2
AGREE = 45.0
"""dB, of means over pixels."""


@pytest.fixture(scope="module", params=[MOVING, OVER_TORSO], ids=["whole", "over a torso"])
def asset(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Asset:
    made = moving_asset(tmp_path_factory.mktemp("face") / "asset", request.param, layers=3)
    write_layered(made.folder.with_suffix(".glb"), made.full, "caps")
    return made


def seen_through(K: np.ndarray, w2c: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The eye (3,) and unit rays (M, 3) through places of a picture (M, 2), in the axes of the file's scene: it has y
    up, so (x, y, z) of the asset is (y, z, x) there."""
    R, t = w2c[:, :3], w2c[:, 3]
    rays = np.concatenate([places, np.ones((len(places), 1))], -1) @ np.linalg.inv(K).T @ R
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return (-R.T @ t)[[1, 2, 0]], rays[:, [1, 2, 0]]


def test_five_views_agree_with_the_reference(asset: Asset) -> None:
    face = Face(asset.folder.with_suffix(".glb").read_bytes())
    picture = face.pictures()[FRAME]
    y, x = (np.mgrid[0 : 2 * SIZE, 0 : 2 * SIZE] + 0.5) / 2  # the centers of the pixels' quarters
    for camera in five_cameras(SIZE):
        eye, rays = seen_through(camera.K, camera.w2c, np.stack([x.ravel(), y.ravel()], -1))
        found = face.render(eye, rays, FRAME, GREY_VALUE, picture)
        expected, _ = render(asset, camera, FRAME, (GREY_VALUE,) * 3)
        assert psnr(found.reshape(SIZE, 2, SIZE, 2, 3).mean((1, 3)), expected) >= AGREE, camera.name


def test_the_example_that_is_kept_shows_what_its_pictures_show(vectors: Path) -> None:
    """As the vectors of today, and as the reader sees it: every ninth pixel, each by its quarters."""
    views = json.loads((KEPT / VIEWS).read_text())["views"]
    made = [view for view in json.loads((vectors / VIEWS).read_text())["views"] if shown_by_example(view)]
    assert [view["file"] for view in views] == [view["file"] for view in made]
    for key in ("K", "w2c"):
        np.testing.assert_allclose([view[key] for view in views], [view[key] for view in made], atol=1e-9)
    assert check_glb(KEPT / EXAMPLE) == []
    face = Face((KEPT / EXAMPLE).read_bytes())
    pictures = face.pictures()
    for view in views:
        places = np.arange(2, view["width"], 9)
        pixels = np.stack(np.meshgrid(places, places), -1).reshape(-1, 1, 2)
        quarters = pixels + np.stack(np.meshgrid((0.25, 0.75), (0.25, 0.75)), -1).reshape(1, -1, 2)
        eye, rays = seen_through(np.array(view["K"]), np.array(view["w2c"]), quarters.reshape(-1, 2))
        found = face.render(eye, rays, view["frame"], np.array(BACKGROUND), pictures[view["frame"]])
        truth = np.asarray(Image.open(KEPT / view["file"]), float)[pixels[:, 0, 1], pixels[:, 0, 0]] / 255
        assert psnr(found.reshape(len(pixels), 4, 3).mean(1), truth) >= AGREE, view["file"]
