"""Conformance vectors: tiny assets, cameras and the pictures that a player must show; and how near somebody's come.

`python -m tests.vectors FOLDER`, then `... FOLDER --check PICTURES` (docs/reference/asset-format.md).
`python -m tests.vectors docs/reference/EXT_layered_volumetric_video/examples --example` writes what is kept.

Made, not kept, but for the extension's example: the same on every machine, but for what float32 rounds. They have what
players get wrong: sheets that fold before the eye (only the nearest crossing counts), half-transparent layers, texels
unlike their neighbours, pixels that hold several texels, rectangles anywhere in the picture, two levels, a head that
moves, a frame rate that is no whole number, and the same take once more as a stream in segments.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.cropping import crop_layers
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.asset.manifest_file import MANIFEST_NAME, write_manifest
from facefolds_core.asset.reader import Asset, read_asset
from facefolds_core.asset.streams import make_streams
from facefolds_core.asset.writer import FULL, AssetSource, LevelContent, manifest_of, write_level
from facefolds_core.files.pictures import open_picture
from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import Window, st_to_uv, uv_to_directions
from facefolds_core.geometry.track import Track
from facefolds_core.packaging.levels import Resampled, write_rungs
from facefolds_core.params import CompressParams, LevelParams, MeshCodec, StreamParams, VideoCodec
from facefolds_core.rendering.pixels import render
from tests.assets import grid_faces
from tests.pictures import render_asset
from tests.scenes import view_of

ASSETS = ("short", "stream")
EXAMPLE = "short.glb"
"""The full level of `short` with the glTF extension EXT_layered_volumetric_video: its views are those of "full"."""
VIEWS = "views.json"
REFERENCE, POINTS = "reference", "reference_points"
"""Folders of what must be shown: means over pixels; and what one ray through each pixel's centre sees."""
RENDERERS = {REFERENCE: render, POINTS: render_asset}
CENTRE = (-0.25, 0.0, 0.0)
WINDOW: Window = (-0.5, 0.5, -0.45, 0.45)
LAYERS, FRAMES, TEXELS, SIDE = 3, 6, 64, 128
RATE = 30000 / 1001
BACKGROUND = (64 / 255, 128 / 255, 192 / 255)
SHOWN_OVER = "#" + "".join(f"{round(255 * value):02x}" for value in BACKGROUND)
LEAST = 40.0
"""dB that a player should reach. 8 bits after each layer's blending leave 50 and more, chroma placed otherwise 40."""


class Waves:
    """Textures of the vectors: (TEXELS, TEXELS, 4), waves that move, with lines and single texels that stand out."""

    def image(self, layer: int, frame: int, /) -> NDArray[np.uint8]:
        s, t = np.meshgrid(*[(np.arange(TEXELS) + 0.5) / TEXELS] * 2)
        phase = 0.7 * frame + 1.3 * layer
        red = 0.55 + 0.35 * np.sin(11 * s + 5 * t + phase)
        green = 0.5 + 0.3 * np.sin(9 * t - 2 * phase)
        blue = 0.45 + 0.3 * np.cos(10 * (s - t) + phase)
        alpha = np.clip(2.95 - 6 * np.hypot(s - 0.5, t - 0.5), 0, 1) * (0.9, 0.5, 1.0)[layer]
        rgba = np.stack([red, green, blue, alpha], -1)
        rgba[8::16, 8::16, :3] = 1 - rgba[8::16, 8::16, :3]
        rgba[np.arange(TEXELS) // 2 % 4 == 1, :, :3] *= 0.35
        return np.asarray(np.rint(255 * np.clip(rgba, 0, 1)), np.uint8)


def sheet(layer: int, side: int) -> TexturedMesh:
    """A cap with a nose and a brow: seen from the side, rays cross it up to three times."""
    s, t = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    st = np.stack([s, t], -1).reshape(-1, 2)
    u, v = st_to_uv(st, WINDOW).T
    bump = 0.13 * np.exp(-((u + 0.05) ** 2 + v**2) / 0.008) + 0.06 * np.exp(-((u - 0.2) ** 2) / 0.004)
    points = np.array(CENTRE) + (0.36 - 0.03 * layer + bump)[:, None] * uv_to_directions(st_to_uv(st, WINDOW))
    return TexturedMesh(points.astype(np.float32), grid_faces(side), st.astype(np.float32))


def source() -> AssetSource:
    """The head nods and turns a little."""
    angles = np.radians(6) * np.sin(np.arange(FRAMES))
    turns = [[[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in angles]
    track = Track.of(turns, np.stack([0.01 * np.arange(FRAMES), np.zeros(FRAMES), -0.02 * np.sin(angles)], -1))
    return AssetSource("vectors", RATE, Similarity.identity(), CENTRE, track)


def cameras() -> list[Camera]:
    """From before, from the sides, from above and near; "odd" has pixels that are not square and its centre aside; of
    "coarse" a pixel holds several texels, which one ray misses."""
    found = []
    for name, azimuth, elevation, distance, side in (
        ("front", 0, 0, 1.2, SIDE),
        ("left", 60, 5, 1.1, SIDE),
        ("right", -75, -10, 1.1, SIDE),
        ("above", 15, 45, 1.0, SIDE),
        ("near", -20, 0, 0.5, SIDE),
        ("odd", 30, 15, 1.3, SIDE),
        ("coarse", -40, 5, 1.2, SIDE // 4),
    ):
        a, e = np.radians([azimuth, elevation])
        outward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.cross(-outward, [0, 0, 1])
        right /= np.linalg.norm(right)
        R = np.stack([right, np.cross(-outward, right), -outward])
        w2c = np.concatenate([R, -R @ (distance * outward)[:, None]], 1)
        f = 1.3 * side
        K = np.array([[f, 0, side / 2], [0, f, side / 2], [0, 0, 1.0]])
        if name == "odd":
            K[0, 0], K[0, 2], K[1, 2] = 1.2 * f, 0.4 * side, 0.55 * side
        found.append(Camera(name, K, w2c, side, side))
    return found


def write_vectors(folder: Path) -> int:
    """Write the assets, `views.json` and the pictures of both filters, whole or not at all; returns how many views."""
    if folder.exists() and any(folder.iterdir()) and not (folder / VIEWS).is_file():
        raise SystemExit(f"{folder} is not empty, and holds no vectors: name another folder")
    with atomic_folder(folder) as out:
        _write_short(out / "short")
        write_layered(out / EXAMPLE, read_asset(out / "short").full, "vectors")
        _write_stream(out / "stream")
        for filtered in RENDERERS:
            (out / filtered).mkdir()
        views = [
            view
            for name in ASSETS
            for level in read_asset(out / name).levels
            for view in _views(name, level.entry.name)
        ]
        for view in views:
            for filtered in RENDERERS:
                picture = _picture(read_asset(out / view["asset"]), view, filtered)
                Image.fromarray(picture).save(out / filtered / view["file"])
        write_json(out / VIEWS, {"background": SHOWN_OVER, "views": views})
    return len(views)


def write_example(folder: Path) -> int:
    """Write `EXAMPLE`, its views and their pictures, whole or not at all; returns how many views."""
    with tempfile.TemporaryDirectory() as made, atomic_folder(folder) as out:
        source = Path(made) / "vectors"
        write_vectors(source)
        views = [view for view in json.loads((source / VIEWS).read_text())["views"] if shown_by_example(view)]
        for name in (EXAMPLE, *(f"{REFERENCE}/{view['file']}" for view in views)):
            shutil.copy(source / name, out)
        write_json(out / VIEWS, {"background": SHOWN_OVER, "views": views})
    return len(views)


def shown_by_example(view: dict[str, Any]) -> bool:
    """Whether a view of `views.json` is one of `EXAMPLE`."""
    return (view["asset"], view["level"]) == ("short", FULL)


def _content() -> LevelContent:
    textures = Waves()
    meshes = [sheet(layer, 24) for layer in range(LAYERS)]
    layers = crop_layers(meshes, [WINDOW] * LAYERS, textures, FRAMES, 2)
    return LevelContent(layers, textures, FRAMES, RATE, 2)


def _params() -> CompressParams:
    level = LevelParams(name="small", mesh_resolution=12, texture_resolution=TEXELS // 2, crf=16)
    return CompressParams(
        mesh=MeshCodec(max_error_pixels=None, quantization_bits=14, texture_coordinate_bits=12, compression_level=7),
        video=VideoCodec(crf=10, target_psnr=None, preset="slow", keyframe_interval=4),
        levels=(level,),
        stream=StreamParams(beyond=0, segment_seconds=3 / RATE),
    )


def _write_short(folder: Path) -> None:
    folder.mkdir()
    full, params = _content(), _params()
    textures = Resampled(full.textures, TEXELS // 2)
    layers = crop_layers([sheet(layer, 12) for layer in range(2)], [WINDOW] * 2, textures, FRAMES)
    small = LevelContent(layers, textures, FRAMES, RATE)
    both = {"small": small, FULL: full}
    levels = [write_level(folder, name, one, params.mesh, params.video) for name, one in both.items()]
    write_manifest(manifest_of(source(), levels, folder), folder / MANIFEST_NAME)


def _write_stream(folder: Path) -> None:
    folder.mkdir()
    levels, _, stream = make_streams(folder, write_rungs(folder, _content(), _params(), None, []), None)
    manifest = manifest_of(source(), levels, folder)
    write_manifest(manifest.model_copy(update={"stream": stream}), folder / MANIFEST_NAME)


def _views(asset: str, level: str) -> Iterator[dict[str, Any]]:
    """Of `short` all cameras in the first frame and some in others, of `stream` a few: what differs is in its files."""
    for index, camera in enumerate(cameras()):
        if (asset, level) != ("short", FULL) and camera.name not in ("left", "odd", "coarse"):
            continue
        for frame in (0,) if index % 2 else (0, 2, FRAMES - 1):
            file = f"{asset}_{level}_{camera.name}_{frame}.png"
            said = {"file": file, "asset": asset, "level": level, "frame": frame, "camera": camera.name}
            yield {**said, **view_of(camera)}


def _picture(asset: Asset, view: dict[str, Any], filtered: str) -> NDArray[np.uint8]:
    level = next(level for level in asset.levels if level.entry.name == view["level"])
    camera = Camera(view["camera"], np.array(view["K"]), np.array(view["w2c"]), view["width"], view["height"])
    rgb, _ = RENDERERS[filtered](level, camera, view["frame"], BACKGROUND)
    return np.asarray(np.rint(255 * np.clip(rgb, 0, 1)), np.uint8)


def compare(folder: Path, pictures: Path) -> dict[str, tuple[float, float]]:
    """Somebody's pictures against those of the vectors in `folder`: name in `views.json` -> dB to what must be shown,
    and to what one ray through each pixel's centre sees; 0 where there is no such picture, or one of another size."""
    files = [view["file"] for view in json.loads((folder / VIEWS).read_text())["views"]]
    return {
        file: (_psnr(folder / REFERENCE / file, pictures / file), _psnr(folder / POINTS / file, pictures / file))
        for file in files
    }


def _psnr(reference: Path, found: Path) -> float:
    if not found.is_file():
        return 0.0
    pair = [np.asarray(open_picture(path).convert("RGB"), float) for path in (reference, found)]
    if pair[0].shape != pair[1].shape:
        return 0.0
    error = float(((pair[0] - pair[1]) ** 2).mean())
    return 99.0 if error == 0 else min(99.0, 10 * float(np.log10(255**2 / error)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the vectors are, or are to be")
    parser.add_argument("--check", type=Path, help="folder of a player's pictures, named as in views.json")
    parser.add_argument("--example", action="store_true", help="write the extension's example alone")
    given = parser.parse_args()
    if given.example:
        print(f"{write_example(given.folder)} pictures of {given.folder / EXAMPLE}")
        return
    if given.check is None:
        print(f"{write_vectors(given.folder)} pictures of two assets in {given.folder}")
        return
    found = compare(given.folder, given.check)
    for file, (means, points) in found.items():
        print(f"{file}: {means:.1f} dB; to one ray a pixel {points:.1f} dB")
    reached = sum(means >= LEAST for means, _ in found.values())
    print(f"{reached} of {len(found)} reach {LEAST:g} dB")
    sys.exit(reached < len(found))


if __name__ == "__main__":
    main()
