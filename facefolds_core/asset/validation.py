"""Say what is wrong with an asset: every problem that can be found, in plain words."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facefolds_core.asset.draco import DracoError, decode_mesh, degenerate_faces
from facefolds_core.asset.manifest import MANIFEST_NAME, Layer, Manifest, Texture, parse_manifest
from facefolds_core.asset.reader import check_file, manifest_problems, mesh_problems
from facefolds_core.asset.video import decode_video, probe_video
from facefolds_core.errors import UserError

_BT709_LIMITED = (1, 1)


def validate_asset(folder: str | Path) -> list[str]:
    """Check an asset whole: manifest, lengths and checksums, meshes, every frame of the video.

    A file whose bytes are not the manifest's is reported and not decoded: decoders promise nothing for such input.

    Returns:
        problems in words, each beginning with the file concerned; empty if the asset is sound.
    """
    folder = Path(folder)
    if not folder.is_dir():
        return [f"{folder}: no such folder"]
    path = folder / MANIFEST_NAME
    try:
        manifest = parse_manifest(path)
    except UserError as error:
        return [_in_words(MANIFEST_NAME, error)]
    problems = [f"{MANIFEST_NAME}: {problem}" for problem in manifest_problems(path, manifest)]
    for layer in manifest.layers:
        problems += [f"{layer.mesh}: {problem}" for problem in _layer_problems(folder, layer)]
    video = manifest.texture.video
    problems += [f"{video}: {problem}" for problem in _video_problems(folder / video, manifest.texture)]
    expected = {MANIFEST_NAME, video, *(layer.mesh for layer in manifest.layers)}
    problems += [
        f"{file.name}: not named in the manifest" for file in sorted(folder.iterdir()) if file.name not in expected
    ]
    return problems


def summary(manifest: Manifest) -> str:
    """One line about a sound asset."""
    texture = manifest.texture
    meshes = sum(layer.bytes for layer in manifest.layers)
    triangles = sum(layer.triangles for layer in manifest.layers)
    return (
        f"{manifest.subject}: {len(manifest.layers)} layers, {triangles} triangles ({meshes} bytes), "
        f"{texture.frames} frames at {texture.fps:g} fps of {texture.layer_resolution}^2 texels a layer "
        f"({texture.bytes} bytes; {texture.width} x {texture.height} H.264, level {texture.level})"
    )


def _in_words(name: str, error: UserError) -> str:
    """A `UserError` on one line."""
    parts = [f"{name}: {error.message}"]
    fields = (("place", error.place), ("expected", error.expected), ("found", error.found))
    parts += [f"{word} {value}" for word, value in fields if value is not None]
    return ", ".join(parts)


def _layer_problems(folder: Path, layer: Layer) -> list[str]:
    path = folder / layer.mesh
    problem = check_file(path, layer.bytes, layer.sha256)
    if problem:
        return [problem]
    try:
        mesh = decode_mesh(path.read_bytes())
    except DracoError as error:
        return [f"not a Draco mesh with texture coordinates: {error}"]
    problems = mesh_problems(mesh, layer.vertices, layer.triangles)
    if not problems:
        flat = np.flatnonzero(degenerate_faces(mesh.vertices, mesh.faces))
        if len(flat):
            problems.append(f"{len(flat)} faces without area, the first is face {flat[0]}")
    return problems


def _video_problems(path: Path, texture: Texture) -> list[str]:
    problem = check_file(path, texture.bytes, texture.sha256)
    if problem:
        return [problem]
    problems = []
    try:
        facts = probe_video(path)
        pairs: list[tuple[str, object, object]] = [
            ("codec", facts.codec, texture.codec),
            ("H.264 level", facts.level, texture.level),
            ("pixel format", facts.pixel_format, texture.pixel_format),
            ("width and height", (facts.width, facts.height), (texture.width, texture.height)),
            ("frames a second", round(float(facts.rate), 6), round(texture.fps, 6)),
        ]
        problems = [f"{name} {found}, the manifest says {said}" for name, found, said in pairs if found != said]
        if facts.tags != _BT709_LIMITED:
            problems.append(f"its colour tags (matrix, range) are {facts.tags}, not BT.709 and limited")
        if problems:
            return problems
        frames = sum(1 for _ in decode_video(path, (texture.width, texture.height), texture.fps))
        if frames != texture.frames:
            problems.append(f"{frames} frames, the manifest says {texture.frames}")
    except UserError as error:
        problems.append(f"{error.message}: {error.found}")
    return problems
