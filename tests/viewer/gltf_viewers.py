"""What the web's viewers of glTF show of a GLB as they come: three.js with its GLTFLoader, Babylon.js, model-viewer."""

from __future__ import annotations

import base64
import io
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Page

from facefolds_core.geometry.cameras import Camera
from facefolds_core.serving.server import serving
from tests.pictures import GREY
from tests.scenes import view_of

VIEWER = Path(__file__).parents[2] / "viewer"
GltfViewer = Literal["three", "babylon", "model_viewer", "layered_three", "layered_babylon"]


def build(folder: Path, viewer: GltfViewer) -> None:
    """A page with the viewer, from the packages that the player's tests have."""
    modules = VIEWER / "node_modules"
    esbuild = [str(modules / ".bin" / "esbuild"), str(Path(__file__).parent / "gltf" / f"{viewer}.js")]
    command = [*esbuild, "--bundle", "--format=esm", f"--outfile={folder / 'page.js'}", "--log-level=error"]
    subprocess.run(command, check=True, env={**os.environ, "NODE_PATH": str(modules)})
    script = '<script type="module" src="page.js"></script>'
    (folder / "index.html").write_text(f'<!doctype html><link rel="icon" href="data:,"><body>{script}')


@contextmanager
def page_with(browser: Browser, folder: Path, glb: Path) -> Iterator[Page]:
    """The page that `build` made in `folder`, with the GLB beside it as head.glb."""
    shutil.copy(glb, folder / "head.glb")
    with serving(folder, {}) as address:
        page = browser.new_page()
        page.goto(address)
        page.wait_for_function("() => window.show")
        yield page
        page.close()


def pictures(
    browser: Browser, folder: Path, glb: Path, cameras: Sequence[Camera], frame: int = 0
) -> dict[str, NDArray[np.float64]]:
    """By camera's name, (H, W, 3) in [0, 1] over grey.

    Args:
        folder: what `build` filled.
        frame: for pages that play.
    """
    with page_with(browser, folder, glb) as page:
        code = "([cameras, background, frame]) => show('head.glb', cameras, background, frame)"
        found = page.evaluate(code, [[view_of(camera) for camera in cameras], GREY, frame])
    shown = [Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB") for data in found]
    return {camera.name: np.asarray(picture) / 255 for camera, picture in zip(cameras, shown, strict=True)}
