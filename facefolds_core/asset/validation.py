"""Say what is wrong with an asset: every problem that can be found, in plain words."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.audio import sound_problem
from facefolds_core.asset.checks import manifest_problems, mesh_problems
from facefolds_core.asset.colour import NEUTRAL
from facefolds_core.asset.draco import DracoError, decode_mesh, degenerate_faces
from facefolds_core.asset.manifest import Layer, Level, Manifest, Reflection, Texture, Video
from facefolds_core.asset.manifest_extras import Picture as StoredPicture
from facefolds_core.asset.manifest_file import MANIFEST_NAME, parse_manifest
from facefolds_core.asset.reader import layer_bytes
from facefolds_core.asset.segments import decode_segments, probe_segments
from facefolds_core.asset.stored import check_file, leads_out
from facefolds_core.asset.track_file import track_problems
from facefolds_core.asset.video import BT709_LIMITED, Picture, decode_video, planes, probe_video
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture, picture_size
from facefolds_core.files.reading import is_folder
from facefolds_core.geometry.meshes import TexturedMesh

_COLOURFUL = 24
"""Codes off neutral that the chroma of the alpha image may be, by the codec's error."""
_MOST_STRAYS = 20
"""Files that the manifest does not name: so many are listed."""
_BINS = 24
"""Of longitude and of the sine of latitude, for `lies_within`."""
_LEAST_SHARED = 8
"""Bins that both meshes must have for an answer."""
_MOST_WRONG = 0.75
"""Of the shared bins: layers touch, fold and have noise, so a few crossings mean nothing."""


def validate_asset(folder: str | Path) -> list[str]:
    """Check an asset whole: manifest, lengths and checksums, meshes, every frame of the video, pictures, sound.

    A file whose bytes are not the manifest's is reported and not decoded: decoders promise nothing for such input.

    Returns:
        problems in words, each beginning with the file concerned; empty if the asset is sound.
    """
    folder = Path(folder)
    if not is_folder(folder):
        return [f"{folder}: no such folder"]
    path = folder / MANIFEST_NAME
    try:
        manifest = parse_manifest(path)
    except UserError as error:
        return [_in_words(error)]
    said = manifest_problems(path, manifest)
    problems = [f"{MANIFEST_NAME}: {problem}" for problem in said]
    whole = set()
    for name, size, sha256 in manifest.files():
        problem = check_file(folder / name, size, sha256)
        problems += [f"{name}: {problem}"] if problem else []
        whole |= set() if problem else {name}
    names = [MANIFEST_NAME, *(name for name, _, _ in manifest.files())]
    problems += [f"{name}: a link that leads out of the folder" for name in names if leads_out(folder, name)]
    problems += _strays(folder, set(names))
    # What the manifest says is what decoders are given room for: nothing is decoded by one that says nonsense.
    return problems if said else problems + list(_content_problems(folder, manifest, whole))


def _strays(folder: Path, expected: set[str]) -> list[str]:
    """Files that the manifest does not name."""
    try:
        found = sorted({entry.name for entry in folder.iterdir()} - expected)
    except OSError as error:
        return [f"{folder}: the folder cannot be listed: {error.strerror}"]
    problems = [f"{name}: not named in the manifest" for name in found[:_MOST_STRAYS]]
    more = len(found) - _MOST_STRAYS
    return problems + ([f"and {more} more files that are not named in the manifest"] if more > 0 else [])


def _content_problems(folder: Path, manifest: Manifest, whole: set[str]) -> Iterator[str]:
    """What is wrong inside the files whose bytes are the manifest's."""
    for level in manifest.levels:
        yield from _mesh_problems(folder, level, whole, manifest.coordinates.sphere_centre)
        for video in level.texture.videos:
            if video.file in whole:
                found = _video_problems(folder, video, level.texture)
                yield from (f"{video.file}: {problem}" for problem in found)
    track = manifest.track_file
    if track is not None and track.file in whole:
        data = (folder / track.file).read_bytes()
        yield from (f"{track.file}: {problem}" for problem in track_problems(manifest, data))
    pictures: list[StoredPicture | Reflection] = [*manifest.pictures]
    pictures += [level.reflection for level in manifest.levels if level.reflection]
    for picture in pictures:
        if picture.file in whole:
            yield from (f"{picture.file}: {found}" for found in _picture_problems(folder / picture.file, picture))
    if manifest.audio and manifest.audio.file in whole:
        texture = manifest.full.texture
        problem = sound_problem(folder / manifest.audio.file, texture.frames / texture.fps)
        yield from [f"{manifest.audio.file}: {problem}"] if problem else []


def _mesh_problems(folder: Path, level: Level, whole: set[str], centre: tuple[float, float, float]) -> Iterator[str]:
    """The layers of a level, each by itself and against the one around it."""
    outer: TexturedMesh | None = None
    for index, layer in enumerate(level.layers):
        mesh, problems = _layer(folder, layer) if layer.mesh in whole else (None, [])
        place = f"{layer.mesh}: layer {index}"
        yield from (f"{place}: {problem}" for problem in problems)
        if mesh is not None and outer is not None and lies_within(outer, mesh, centre):
            yield f"{place} lies around the layer before it: the order is from the outermost in"
        outer = mesh


def summary(manifest: Manifest) -> str:
    """One line about a sound asset."""
    texture = manifest.full.texture
    levels = ", ".join(
        f"{level.name} ({len(level.layers)} layers, {sum(layer.triangles for layer in level.layers)} triangles, "
        f"{level.texture.width} x {level.texture.height} pixels, {level.bytes} bytes)"
        for level in manifest.levels
    )
    return f"{manifest.subject}: {texture.frames} frames at {texture.fps:g} fps; {levels}"


def _in_words(error: UserError) -> str:
    """A `UserError` of the manifest on one line."""
    parts = [f"{MANIFEST_NAME}: {error.message}"]
    fields = (("place", error.place), ("expected", error.expected), ("found", error.found))
    parts += [f"{word} {value}" for word, value in fields if value is not None]
    return ", ".join(parts)


def _layer(folder: Path, layer: Layer) -> tuple[TexturedMesh | None, list[str]]:
    """A layer's mesh (None if it is unusable), and what is wrong with it."""
    try:
        mesh = decode_mesh(layer_bytes(folder, layer))
    except UserError as error:
        return None, [str(error.found)]
    except DracoError as error:
        return None, [f"not a Draco mesh with texture coordinates: {error}"]
    problems = mesh_problems(mesh, layer.vertices, layer.triangles)
    if problems:
        return None, problems
    flat = np.flatnonzero(degenerate_faces(mesh.vertices, mesh.faces))
    return mesh, [f"{len(flat)} faces without area, the first is face {flat[0]}"] if len(flat) else []


def _video_problems(folder: Path, video: Video, texture: Texture) -> list[str]:
    path, problems = folder / video.file, []
    try:
        facts = probe_video(path) if video.segments is None else probe_segments(folder, video, texture)
        pairs: list[tuple[str, object, object]] = [
            ("codec", facts.codec, video.codec),
            ("container", facts.container, video.container),
            ("level", facts.level, video.level),
            ("MIME type", facts.mime, video.mime),
            ("pixel format", facts.pixel_format, video.pixel_format),
            ("width and height", (facts.width, facts.height), (texture.width, texture.height)),
            ("frames a second", facts.rate, texture.rate),
        ]
        problems = [f"{name} {found}, the manifest says {said}" for name, found, said in pairs if found != said]
        if facts.tags != BT709_LIMITED:
            problems.append(f"its colour tags (matrix, range) are {facts.tags}, not BT.709 and limited")
        if problems:
            return problems
        frames = 0
        size = texture.width, texture.height
        whole = video.segments is None
        pictures = decode_video(path, size, texture.fps) if whole else decode_segments(folder, video, texture)
        for picture in pictures:
            if frames == 0 and _colourful(picture, texture):
                problems.append("there are colours in its alpha_rect: it may stand in colour_rect's place")
            frames += 1
            if frames > texture.frames:
                return [*problems, f"at least {frames} frames, the manifest says {texture.frames}"]
        if frames != texture.frames:
            problems.append(f"{frames} frames, the manifest says {texture.frames}")
    except UserError as error:
        problems.append(f"{error.message}: {error.found}")
    return problems


def _colourful(picture: Picture, texture: Texture) -> bool:
    """Whether more than one in a hundred pixels of the alpha image has a hue: it should have none."""
    x, y, w, h = (number // 2 for number in texture.alpha_rect)
    chroma = np.stack(planes(picture)[1:])[:, y : y + h, x : x + w]
    return bool((np.abs(chroma.astype(np.int16) - NEUTRAL) > _COLOURFUL).any(0).mean() > 0.01)


def _picture_problems(path: Path, said: StoredPicture | Reflection) -> list[str]:
    try:
        size = picture_size(path)
        if size != (said.width, said.height):
            # Not decoded: the manifest's size is bounded, this one may be anything.
            return [f"{size[0]} x {size[1]} pixels, the manifest says {said.width} x {said.height}"]
        mode = open_picture(path).mode
    except (OSError, DamagedPictureError) as error:
        return [f"not a picture: {error}"]
    return [] if mode == "RGB" else [f"a picture of mode {mode}, not RGB"]


def lies_within(outer: TexturedMesh, inner: TexturedMesh, centre: tuple[float, float, float]) -> bool:
    """Whether `outer`, of two neighbours from the outermost in, clearly lies within `inner`: the wrong order."""
    a, b = _radii(outer, centre), _radii(inner, centre)
    shared = np.isfinite(a) & np.isfinite(b)
    if shared.sum() < _LEAST_SHARED:
        return False
    return bool((a[shared] < b[shared]).mean() > _MOST_WRONG)


def _radii(mesh: TexturedMesh, centre: tuple[float, float, float]) -> NDArray[np.float64]:
    """(_BINS²,) mean distance from the centre of the faces' middles in each bin of directions; NaN where none."""
    middles = mesh.vertices[mesh.faces].astype(np.float64).mean(1) - np.array(centre)
    radii = np.maximum(np.linalg.norm(middles, axis=1), 1e-12)
    longitude = (np.arctan2(middles[:, 1], middles[:, 0]) / np.pi + 1) / 2
    latitude = (middles[:, 2] / radii + 1) / 2
    places = [np.minimum((_BINS * part).astype(np.int64), _BINS - 1) for part in (longitude, latitude)]
    index = places[0] * _BINS + places[1]
    counts = np.bincount(index, minlength=_BINS * _BINS)
    sums = np.bincount(index, weights=radii, minlength=_BINS * _BINS)
    with np.errstate(invalid="ignore"):
        return np.asarray(sums / counts)
