"""How near an engine comes to the reference on an asset: the figures and pictures of docs/guide/engines.md.

python -m tests.engines.agreement blender data/actor/asset --picture docs/images/blender.jpg
python -m tests.engines.agreement model_viewer data/actor/asset      # or three, babylon: the GLB, after `make package`
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset import read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.cli.render import pick_level
from facefolds_core.geometry.cameras import Camera
from facefolds_core.registry import EXPORTERS
from tests.chromium import headless
from tests.engines import blender, godot
from tests.pictures import GREY_VALUE, expected_pictures, five_cameras, psnr, turned_cameras
from tests.viewer import gltf_viewers

Found = dict[tuple[str, int], NDArray[np.float64]]
SHOWN = ("front", "left", "grazing")
PANE, ZOOM = 360, 1.6
"""Of the picture: pixels, and how much nearer than `five_cameras` it looks."""


def in_blender(level: AssetLevel, cameras: list[Camera], frames: list[int], place: Path) -> Found:
    found: Found = {}
    for frame in frames:
        write_glb(place / "head.glb", level, "head", frame)
        pictures = blender.pictures(place / "head.glb", cameras, GREY_VALUE)
        found |= {(name, frame): picture for name, picture in pictures.items()}
    return found


def in_godot(level: AssetLevel, cameras: list[Camera], frames: list[int], place: Path) -> Found:
    EXPORTERS["godot"].export(place / "asset", level, "head")
    return godot.pictures(place / "asset", cameras, frames, GREY_VALUE)


def in_blender_by_usd(level: AssetLevel, cameras: list[Camera], frames: list[int], place: Path) -> Found:
    """Blender knows no textures sampled in time: the first frame, whatever is asked for."""
    EXPORTERS["usd"].export(place / "usd", level, "head")
    pictures = blender.pictures(place / "usd" / "face.usdc", cameras, GREY_VALUE)
    return {(name, frames[0]): picture for name, picture in pictures.items()}


def in_the_web(level: AssetLevel, cameras: list[Camera], place: Path, viewer: gltf_viewers.GltfViewer) -> Found:
    """The GLB of the first frame in a viewer of glTF."""
    write_glb(place / "a.glb", level, "head")
    gltf_viewers.build(place, viewer)
    with headless() as browser:
        found = gltf_viewers.pictures(browser, place, place / "a.glb", cameras)
    return {(name, 0): picture for name, picture in found.items()}


def main(
    engine: Annotated[Literal["blender", "godot", "usd", "three", "babylon", "model_viewer"], typer.Argument()],
    asset: Annotated[Path, typer.Argument(help="Folder of the asset.")],
    size: Annotated[int, typer.Option(help="Pixels of a side.")] = 320,
    level: Annotated[str | None, typer.Option(help="Level of detail; the full one if left out.")] = None,
    picture: Annotated[Path | None, typer.Option(help="JPEG to write: front, 45 degrees, side.")] = None,
) -> None:
    """PSNR to the reference, five cameras, first, middle and last frame (GLB and USD: the first)."""
    whole = read_asset(asset)
    shown = pick_level(whole, level)
    web = engine in ("three", "babylon", "model_viewer")
    render: Callable[..., Found]
    if web:
        render = lambda level, cameras, _, place: in_the_web(level, cameras, place, engine)  # noqa: E731
    else:
        render = {"blender": in_blender, "godot": in_godot, "usd": in_blender_by_usd}[engine]
    frames = [0] if web or engine == "usd" else sorted({0, whole.num_frames // 2, whole.num_frames - 1})
    cameras = turned_cameras(size) if web else five_cameras(size)
    with tempfile.TemporaryDirectory() as place:
        found = render(shown, cameras, frames, Path(place))
    expected = expected_pictures(shown, cameras, frames)
    for camera in cameras:
        scores = [psnr(found[camera.name, frame], expected[camera.name, frame]) for frame in frames]
        typer.echo(f"{engine} {camera.name:8s} " + " ".join(f"{score:.1f}" for score in scores) + " dB")
    if picture:
        zoom = np.diag([ZOOM, ZOOM, 1])
        zoom[:2, 2] = (1 - ZOOM) * PANE / 2
        near = [replace(camera, K=zoom @ camera.K) for camera in five_cameras(PANE) if camera.name in SHOWN]
        with tempfile.TemporaryDirectory() as place:
            found = render(shown, near, [0], Path(place))
        strip = np.concatenate([found[name, 0] for name in SHOWN], 1)
        Image.fromarray(np.uint8(np.rint(255 * strip))).save(picture, quality=88)


if __name__ == "__main__":
    typer.run(main)
