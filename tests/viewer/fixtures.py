"""Assets for the player's tests, made once a session."""

from __future__ import annotations

import hashlib
import json
import shutil
import wave
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset import Asset, read_asset
from facefolds_core.asset.manifest import Manifest, Reflection
from facefolds_core.asset.manifest_file import parse_manifest, write_manifest
from facefolds_core.asset.reflection import pack_reflection
from facefolds_core.asset.writer import AssetSource
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.params import CompressParams, VideoCodec
from tests.assets import MOVING, make_asset
from tests.scenes import look_at_origin, view_of

THREE_CODECS = CompressParams(video=VideoCodec(codec=("h264", "vp9", "av1"), crf=8, preset="slow", keyframe_interval=4))


def file_entry(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    return {"file": path.name, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}


def flipped(data: bytes, at: int) -> bytes:
    """With one bit changed in the byte at that place."""
    spoiled = bytearray(data)
    spoiled[at] ^= 1
    return bytes(spoiled)


def change_manifest(folder: Path, change: Callable[[dict[str, Any]], None]) -> Manifest:
    """Edit the manifest of an asset as JSON, bring sizes up to date, validate and seal it again."""
    path = folder / "manifest.json"
    value = parse_manifest(path).model_dump(mode="json")
    change(value)
    for level in value["levels"]:
        entries = [*level["meshes"], *level["texture"]["videos"], *filter(None, [level.get("reflection")])]
        level["bytes"] = sum(entry["bytes"] for entry in entries)
    return write_manifest(Manifest.model_validate_json(json.dumps(value)), path)


def write_png(path: Path, image: NDArray[np.uint8]) -> dict[str, Any]:
    Image.fromarray(image).save(path)
    return file_entry(path)


def rich_asset(folder: Path) -> Path:
    """All that the format knows: two levels, three videos, a reflection, poster, photos, sound; 6 frames."""
    make_asset(folder, layers=3, frames=6, resolution=96, params=THREE_CODECS)
    coarse = folder.with_name(f"{folder.name}-coarse")
    make_asset(coarse, layers=2, frames=6, resolution=32)
    level = parse_manifest(coarse / "manifest.json").model_dump(mode="json")["levels"][0]
    level["name"] = "coarse"
    shutil.copy(coarse / "full_meshes.bin", folder / "coarse_meshes.bin")
    level["meshes"][0]["file"] = "coarse_meshes.bin"
    for entry in level["layers"]:
        entry["mesh"] = "coarse_meshes.bin"
    shutil.copy(coarse / "full.mp4", folder / "coarse.mp4")
    level["texture"]["videos"][0]["file"] = "coarse.mp4"
    with wave.open(str(folder / "audio.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes((3000 * np.sin(np.arange(1600) / 4)).astype("<i2").tobytes())
    photo = np.zeros((60, 90, 3), np.uint8)
    photo[:, :, 0] = 255

    def change(value: dict[str, Any]) -> None:
        full = value["levels"][0]
        full["reflection"] = reflection_of(folder)
        value["levels"].insert(0, level)
        value["audio"] = file_entry(folder / "audio.wav")
        value["poster"] = write_png(folder / "poster.png", photo) | {"width": 90, "height": 60}
        value["photos"] = [photo_entry(folder, index, frame) for index, frame in enumerate((2, 4))]

    change_manifest(folder, change)
    return folder


def random_reflection() -> ReflectionMaps:
    """Strong, coloured, with normals all over the front; its window is not that of the layers."""
    rng = np.random.default_rng(0)
    normals = np.stack([np.ones((6, 5)), *rng.uniform(-0.7, 0.7, (2, 6, 5))], -1)
    parts = rng.random((6, 5)), 0.3 * rng.random((6, 5, 3)), normals, rng.random((9, 9, 3))
    gloss, offset, facing, environment = (np.asarray(part, np.float32) for part in parts)
    return ReflectionMaps((-0.9, 0.8, -0.7, 0.9), gloss, offset, facing, environment)


def reflection_of(folder: Path) -> dict[str, Any]:
    """Write the picture of `random_reflection`; what a level's manifest says of it."""
    png, said = pack_reflection(random_reflection())
    (folder / "full_reflection.png").write_bytes(png)
    entry = Reflection.model_validate(file_entry(folder / "full_reflection.png") | said)
    return entry.model_dump(mode="json")


def add_reflection(folder: Path) -> None:
    """`random_reflection` in the full level."""
    entry = reflection_of(folder)
    change_manifest(folder, lambda value: value["levels"][-1].update(reflection=entry))


def shining(asset: Asset, folder: Path) -> Asset:
    """A copy of an asset with `random_reflection`."""
    shutil.copytree(asset.folder, folder)
    add_reflection(folder)
    return read_asset(folder)


def moving_asset(folder: Path, source: AssetSource = MOVING, **options: Any) -> Asset:
    """Three frames of a head that moves in the light of its room; over a torso it is all that the extension of glTF
    says."""
    make_asset(folder, frames=3, source=source, **options)
    add_reflection(folder)
    return read_asset(folder)


def photo_entry(folder: Path, index: int, frame: int) -> dict[str, Any]:
    camera = look_at_origin(f"photo{index}", 30 * index, 5, 64)
    image = np.full((64, 64, 3), (40, 80 + 60 * index, 200), np.uint8)
    entry = write_png(folder / f"photo{index}.png", image)
    return entry | {"camera": camera.name, "frame": frame} | view_of(camera)
