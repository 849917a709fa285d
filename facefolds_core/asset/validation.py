"""Say what is wrong with an asset: every problem that can be found, in plain words."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facefolds_core.asset.draco import DracoError, decode_mesh, degenerate_faces
from facefolds_core.asset.manifest import (
    MANIFEST_NAME,
    Layer,
    Manifest,
    Poster,
    Texture,
    Video,
    ViewEffects,
    parse_manifest,
)
from facefolds_core.asset.reader import check_file, manifest_problems, mesh_problems
from facefolds_core.asset.video import decode_video, probe_video
from facefolds_core.errors import UserError
from facefolds_core.pictures import DamagedPictureError, open_picture

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
    whole = set()
    for name, size, sha256 in manifest.files():
        problem = check_file(folder / name, size, sha256)
        problems += [f"{name}: {problem}"] if problem else []
        whole |= set() if problem else {name}
    for level in manifest.levels:
        for layer in level.layers:
            if layer.mesh in whole:
                problems += [f"{layer.mesh}: {problem}" for problem in _layer_problems(folder / layer.mesh, layer)]
        for video in level.texture.videos:
            if video.file in whole:
                found = _video_problems(folder / video.file, video, level.texture)
                problems += [f"{video.file}: {problem}" for problem in found]
    pictures: list[Poster | ViewEffects] = [*manifest.photos, *([manifest.poster] if manifest.poster else [])]
    pictures += [level.view_effects for level in manifest.levels if level.view_effects]
    for picture in pictures:
        if picture.file in whole:
            problems += [f"{picture.file}: {problem}" for problem in _picture_problems(folder / picture.file, picture)]
    expected = {MANIFEST_NAME, *(name for name, _, _ in manifest.files())}
    problems += [
        f"{file.name}: not named in the manifest" for file in sorted(folder.iterdir()) if file.name not in expected
    ]
    return problems


def summary(manifest: Manifest) -> str:
    """One line about a sound asset."""
    texture = manifest.full.texture
    levels = ", ".join(
        f"{level.name} ({len(level.layers)} layers, {sum(layer.triangles for layer in level.layers)} triangles, "
        f"{level.texture.width} x {level.texture.height} pixels, {level.bytes} bytes)"
        for level in manifest.levels
    )
    return f"{manifest.subject}: {texture.frames} frames at {texture.fps:g} fps; {levels}"


def _in_words(name: str, error: UserError) -> str:
    """A `UserError` on one line."""
    parts = [f"{name}: {error.message}"]
    fields = (("place", error.place), ("expected", error.expected), ("found", error.found))
    parts += [f"{word} {value}" for word, value in fields if value is not None]
    return ", ".join(parts)


def _layer_problems(path: Path, layer: Layer) -> list[str]:
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


def _video_problems(path: Path, video: Video, texture: Texture) -> list[str]:
    problems = []
    try:
        facts = probe_video(path)
        pairs: list[tuple[str, object, object]] = [
            ("codec", facts.codec, video.codec),
            ("container", facts.container, video.container),
            ("level", facts.level, video.level),
            ("MIME type", facts.mime, video.mime),
            ("pixel format", facts.pixel_format, video.pixel_format),
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


def _picture_problems(path: Path, said: Poster | ViewEffects) -> list[str]:
    try:
        picture = open_picture(path)
    except (OSError, DamagedPictureError) as error:
        return [f"not a picture: {error}"]
    found = [] if picture.mode == "RGB" else [f"a picture of mode {picture.mode}, not RGB"]
    if picture.size != (said.width, said.height):
        found.append(f"{picture.width} x {picture.height} pixels, the manifest says {said.width} x {said.height}")
    return found
