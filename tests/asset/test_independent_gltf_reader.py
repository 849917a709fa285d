"""The extension's text is enough: a reader written from it alone sees what the reference renderer sees."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.asset import Asset
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.rendering.pixels import render
from tests.asset.independent_gltf_reader import Face
from tests.assets import MOVING, OVER_TORSO
from tests.pictures import GREY_VALUE, five_cameras, psnr
from tests.viewer.fixtures import moving_asset

pytestmark = pytest.mark.slow

SIZE, FRAME = 24, 2
AGREE = 45.0
"""dB, of means over pixels."""


@pytest.fixture(scope="module", params=[MOVING, OVER_TORSO], ids=["whole", "over a torso"])
def asset(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Asset:
    made = moving_asset(tmp_path_factory.mktemp("face") / "asset", request.param, layers=3)
    write_layered(made.folder.with_suffix(".glb"), made.full, "caps")
    return made


def test_five_views_agree_with_the_reference(asset: Asset) -> None:
    face = Face(asset.folder.with_suffix(".glb").read_bytes())
    picture = face.pictures()[FRAME]
    y, x = (np.mgrid[0 : 2 * SIZE, 0 : 2 * SIZE] + 0.5) / 2  # the centers of the pixels' quarters
    for camera in five_cameras(SIZE):
        pixels = np.stack([x.ravel(), y.ravel(), np.ones(4 * SIZE * SIZE)], -1)
        R, t = camera.w2c[:, :3], camera.w2c[:, 3]
        rays = pixels @ np.linalg.inv(camera.K).T @ R
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        # The scene of the file has y up: (x, y, z) of the asset is (y, z, x) there.
        found = face.render((-R.T @ t)[[1, 2, 0]], rays[:, [1, 2, 0]], FRAME, GREY_VALUE, picture)
        expected, _ = render(asset, camera, FRAME, (GREY_VALUE,) * 3)
        assert psnr(found.reshape(SIZE, 2, SIZE, 2, 3).mean((1, 3)), expected) >= AGREE, camera.name
