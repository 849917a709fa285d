"""The GLB in three.js, opened by its own loader, against the reference renderer."""

from __future__ import annotations

import base64
import io
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser

from facefolds_core.asset import read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.serving import serving
from tests.assets import make_asset
from tests.pictures import GREY, expected_pictures, five_cameras, psnr

SIZE = 128
FRAME = 1
AGREE = 40.0
"""dB. Seen: 48 and more."""


@pytest.fixture(scope="module")
def page_folder(tmp_path_factory: pytest.TempPathFactory, project_root: Path, player_folder: Path) -> Path:
    """A page with three.js and its loaders, from the player's own packages."""
    folder, modules = tmp_path_factory.mktemp("gltf"), project_root / "viewer" / "node_modules"
    esbuild = [str(modules / ".bin" / "esbuild"), str(Path(__file__).parent / "gltf" / "page.js")]
    command = [*esbuild, "--bundle", "--format=esm", f"--outfile={folder / 'page.js'}", "--log-level=error"]
    subprocess.run(command, check=True, env={**os.environ, "NODE_PATH": str(modules)})
    script = '<script type="module" src="page.js"></script>'
    (folder / "index.html").write_text(f'<!doctype html><link rel="icon" href="data:,">{script}')
    return folder


def test_five_cameras_agree_with_the_reference(browser: Browser, page_folder: Path, tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=4, frames=3, resolution=96)
    asset, cameras = read_asset(tmp_path / "asset"), five_cameras(SIZE)
    write_glb(page_folder / "a.glb", asset.full, "caps", frame=FRAME)
    given = [{"K": c.K.tolist(), "w2c": c.w2c.tolist(), "width": c.width, "height": c.height} for c in cameras]
    with serving(page_folder, {}) as address:
        page = browser.new_page()
        page.goto(address)
        found = page.evaluate("([cameras, background]) => show('a.glb', cameras, background)", [given, GREY])
        page.close()
    expected = expected_pictures(asset, cameras, [FRAME])
    for camera, data in zip(cameras, found, strict=True):
        picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")) / 255
        assert psnr(picture, expected[camera.name, FRAME]) >= AGREE, camera.name
