"""What can be wrong with a manifest or a mesh, in words: what the reader refuses and the validator reports.

Bounds are far beyond what any asset has (the cameras are about 1 unit away; a picture is what codecs allow): they tell
nonsense from data, and keep a damaged number from asking for all of a machine's memory.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np

from facefolds_core.asset.manifest import Coordinates, Level, Manifest
from facefolds_core.asset.manifest_base import FARTHEST, Row, Vector
from facefolds_core.asset.manifest_file import MANIFEST_NAME, seal_is_whole
from facefolds_core.asset.packing import MAX_PIXELS, MAX_SIDE, AtlasLayout, inside
from facefolds_core.asset.segments import segment_problems
from facefolds_core.asset.track_file import track_problems
from facefolds_core.geometry.cameras import is_rotation
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window

SMALLEST = 1e-6
"""Units, of a mesh's longest side."""
FPS_RANGE = (1e-3, 1e3)
MOST_FRAMES = 1_000_000
MOST_VERTICES = 1 << 23
"""Of one mesh; triangles likewise."""
SCALE_RANGE = (1e-9, 1e9)
MEASURED = 1e-2
"""How far from a rotation a photo's camera may be: captures measure theirs, and are given 1e-3."""
LONGEST_TEXT = 200
MOST_LAYERS = 256
"""Of a level; levels and photos likewise."""


def layout_of(level: Level) -> AtlasLayout:
    """Where the manifest says the textures lie."""
    texture = level.texture
    return AtlasLayout(
        width=texture.width,
        height=texture.height,
        colour_rect=texture.colour_rect,
        alpha_rect=texture.alpha_rect,
        rects=tuple(layer.texture_rect for layer in level.layers),
    )


def manifest_problems(path: Path, manifest: Manifest) -> list[str]:
    """What is wrong inside a manifest that has all its keys, in words; the files that it names are not looked at."""
    problems, frames = [], manifest.full.texture.frames
    if not seal_is_whole(path.read_bytes()):
        problems.append("manifest_sha256 is not this file's: its content was changed")
    parts = [manifest.levels, manifest.photos, *(level.layers for level in manifest.levels)]
    if max(map(len, parts)) > MOST_LAYERS:
        return [*problems, f"more than {MOST_LAYERS} levels, layers of a level, or photos"]
    for level in manifest.levels:
        problems += [f"level {level.name}: {problem}" for problem in _level_problems(level)]
    problems += _order_problems(manifest) + _switchable_problems(manifest)
    problems += _coordinate_problems(manifest.coordinates)
    problems += [f"track: {problem}" for problem in track_problems(manifest)] + _extent_problems(manifest)
    for photo in manifest.photos:
        late = [f"frame {photo.frame} of {frames}"] * (photo.frame >= frames)
        problems += [f"{photo.file}: {problem}" for problem in late + _camera_problems(photo.K, photo.w2c)]
    problems += _poster_problems(manifest)
    problems += [
        f"{picture.file}: {problem}"
        for picture in manifest.pictures
        for problem in _size_problems(picture.width, picture.height)
    ]
    names = [MANIFEST_NAME, *(name for name, _, _ in manifest.files())]
    if len({name.lower() for name in names}) != len(names):  # there are file systems that do not tell a from A
        problems.append("one file is named twice")
    texts = [manifest.subject, manifest.generator, *(photo.camera for photo in manifest.photos)]
    texts += [video.mime for level in manifest.levels for video in level.texture.videos]
    texts += [manifest.audio.mime] if manifest.audio and manifest.audio.mime else []
    texts += [*(manifest.extensions_used or ()), *(manifest.extensions_required or ())]
    problems += [
        f"a text that is too long, or has characters that do not print: {text[:40]!r}"
        for text in texts
        if len(text) > LONGEST_TEXT or not text.isprintable()
    ]
    return problems


def _extent_problems(manifest: Manifest) -> list[str]:
    """Of `bounds`, of the distances of `view`, and of the names of extensions."""
    problems, bounds, view = [], manifest.bounds, manifest.view
    if bounds is not None:
        if not all(a <= b for a, b in zip(bounds.min, bounds.max, strict=True)):
            problems.append("bounds.min is beyond bounds.max")
        if not max(map(abs, (*bounds.min, *bounds.max))) <= FARTHEST:
            problems.append(f"bounds of more than {FARTHEST:g} units")
    distances = [] if view is None else [*(view.distance or ()), *(one[2] for one in view.measured or ())]
    if not all(0 <= distance <= FARTHEST for distance in distances):
        problems.append(f"view has distances that are not within 0 and {FARTHEST:g}")
    if not set(manifest.extensions_required or ()) <= set(manifest.extensions_used or ()):
        problems.append("extensionsRequired has names that extensionsUsed lacks")
    return problems


def _switchable_problems(manifest: Manifest) -> list[str]:
    """Whether levels that say so differ in nothing but their videos and the size of these."""
    sets: dict[str, list[Level]] = {}
    for level in manifest.levels:
        if level.switchable is not None:
            sets.setdefault(level.switchable, []).append(level)
    return [
        f"level {one.name} is not {levels[0].name} at another size: they are not switchable"
        for levels in sets.values()
        for one in levels[1:]
        if _but_size(one) != _but_size(levels[0])
    ]


def _but_size(level: Level) -> list[object]:
    """What levels that can be switched share: meshes, and places in shares of the picture."""
    texture = level.texture
    width, height = texture.width, texture.height
    found: list[object] = [[(file.file, file.sha256) for file in level.meshes], texture.keyframes]
    for x, y, w, h in (texture.colour_rect, texture.alpha_rect, *(layer.texture_rect for layer in level.layers)):
        found.append((Fraction(x, width), Fraction(y, height), Fraction(w, width), Fraction(h, height)))
    return found + [(layer.mesh, layer.offset, layer.uv_window) for layer in level.layers]


def _order_problems(manifest: Manifest) -> list[str]:
    levels = manifest.levels
    problems = []
    if len({level.name for level in levels}) != len(levels):
        problems.append("two levels have one name")
    if len({(level.texture.frames, level.texture.rate) for level in levels}) != 1:
        problems.append("the levels differ in frames or frame_rate")
    for coarse, fine in pairwise(levels):
        # Finer in one respect may be coarser in another. In none coarser, in bytes, triangles and texels finer: wrong.
        if all(a > b for a, b in zip(_fineness(coarse), _fineness(fine), strict=True)):
            problems.append(
                f"level {coarse.name} comes before {fine.name}, which is coarser: the order is coarsest first"
            )
    return problems


def _fineness(level: Level) -> tuple[int, int, int]:
    texels = sum(layer.texture_rect[2] * layer.texture_rect[3] for layer in level.layers)
    return level.bytes, sum(layer.triangles for layer in level.layers), texels


def _coordinate_problems(coordinates: Coordinates) -> list[str]:
    problems = []
    to_capture = coordinates.to_capture
    if not _is_rotation(to_capture.rotation):
        problems.append("coordinates.to_capture.rotation is not a rotation")
    low, high = SCALE_RANGE
    if not low <= to_capture.scale <= high:
        problems.append(f"coordinates.to_capture.scale is {to_capture.scale:g}, not within {low:g} and {high:g}")
    if not max(map(abs, to_capture.translation)) <= FARTHEST * high:
        problems.append(f"coordinates.to_capture.translation is {list(to_capture.translation)}")
    if not max(map(abs, coordinates.sphere_centre)) <= FARTHEST:
        problems.append(f"coordinates.sphere_centre is {list(coordinates.sphere_centre)}: the subject is at the origin")
    return problems


def _is_rotation(rows: tuple[tuple[float, ...], ...], tolerance: float = 1e-6) -> bool:
    rotation = np.array(rows)  # larger numbers than 2 might overflow
    return bool(np.abs(rotation).max() <= 2) and is_rotation(rotation, tolerance)


def _poster_problems(manifest: Manifest) -> list[str]:
    poster = manifest.poster
    if poster is None or (poster.K is None and poster.w2c is None and poster.background is None):
        return []
    if poster.K is None or poster.w2c is None or poster.background is None:
        return ["the poster's K, w2c and background come together"]
    problems = [f"poster: {problem}" for problem in _camera_problems(poster.K, poster.w2c)]
    return problems + ["the poster's background is no colour"] * (not all(0 <= c <= 1 for c in poster.background))


def _camera_problems(K: tuple[Vector, Vector, Vector], w2c: tuple[Row, Row, Row]) -> list[str]:
    problems = []
    if not _is_rotation(tuple(row[:3] for row in w2c), MEASURED):
        problems.append("the first three columns of w2c are not a rotation")
    if not max(abs(row[3]) for row in w2c) <= FARTHEST:
        problems.append(f"its camera is more than {FARTHEST:g} units away")
    (fx, _, _), (_, fy, _), last = K
    if not (min(fx, fy) > 0 and max(fx, fy) <= FARTHEST * MAX_SIDE and np.allclose(last, (0, 0, 1), atol=MEASURED)):
        problems.append("K is no camera's")
    return problems


def _size_problems(width: int, height: int) -> list[str]:
    if max(width, height) <= MAX_SIDE and width * height <= 2 * MAX_PIXELS:
        return []
    return [f"{width} x {height} pixels: at most {MAX_SIDE} a side and {2 * MAX_PIXELS} in all"]


def _level_problems(level: Level) -> list[str]:
    texture = level.texture
    problems = _size_problems(texture.width, texture.height)
    if texture.width % 2 or texture.height % 2:
        problems.append(f"a video of {texture.width} x {texture.height} pixels: both must be even")
    low, high = FPS_RANGE
    if not low <= texture.fps <= high:
        problems.append(f"{texture.fps:g} frames a second, not within {low:g} and {high:g}")
    problems += [f"{video.file}: {found}" for video in texture.videos for found in segment_problems(video, texture)]
    keys = texture.keyframes
    if keys[0] != 0 or keys[-1] >= texture.frames or any(a >= b for a, b in pairwise(keys)):
        problems.append("keyframes are not frames in order, 0 the first")
    if texture.frames > min(MOST_FRAMES, *(video.bytes for video in texture.videos)):
        problems.append(f"{texture.frames} frames, more than its videos can hold")
    problems += layout_of(level).problems()
    for index, layer in enumerate(level.layers):
        problems += _window_problems(layer.uv_window, f"layer {index}")
        if max(layer.vertices, layer.triangles) > MOST_VERTICES:
            problems.append(f"{layer.vertices} vertices and {layer.triangles} triangles of layer {index}: too many")
    problems += _mesh_file_problems(level)
    if level.bytes != (total := sum(size for _, size, _ in level.files())):
        problems.append(f"bytes are {level.bytes}, those of its files are {total}")
    return problems + _reflection_problems(level)


def _window_problems(window: Window, what: str) -> list[str]:
    u0, u1, v0, v1 = window
    return [] if u0 < u1 and v0 < v1 else [f"uv_window {list(window)} of {what} is empty"]


def _mesh_file_problems(level: Level) -> list[str]:
    """Whether the layers' meshes lie in the files that the level has for them."""
    sizes = {file.file: file.bytes for file in level.meshes}
    problems = [
        f"the mesh of layer {index} is not inside a file of `meshes`"
        for index, layer in enumerate(level.layers)
        if layer.offset + layer.bytes > sizes.get(layer.mesh, 0)
    ]
    unused = sorted(set(sizes) - {layer.mesh for layer in level.layers})
    return problems + [f"{name} holds no layer's mesh" for name in unused]


def _reflection_problems(level: Level) -> list[str]:
    one = level.reflection
    if one is None:
        return []
    problems = _size_problems(one.width, one.height) + _window_problems(one.uv_window, "the reflection")
    problems += [
        f"{list(rect)} is not inside the reflection's picture"
        for rect in one.rects()
        if not inside(rect, (one.width, one.height))
    ]
    return problems


def mesh_problems(mesh: TexturedMesh, vertices: int, triangles: int) -> list[str]:
    """What makes a decoded mesh unusable or different from its manifest's counts, in words."""
    problems = []
    if len(mesh.vertices) != vertices:
        problems.append(f"{len(mesh.vertices)} vertices, the manifest says {vertices}")
    if len(mesh.faces) != triangles:
        problems.append(f"{len(mesh.faces)} triangles, the manifest says {triangles}")
    if not np.isfinite(mesh.vertices).all():
        problems.append("vertices that are not finite")
    elif (farthest := float(np.abs(mesh.vertices).max())) > FARTHEST:
        problems.append(f"vertices {farthest:g} units from the origin: the capture's cameras are about 1 away")
    elif float(np.ptp(mesh.vertices, axis=0).max()) < SMALLEST:
        problems.append("all vertices lie at one point")
    if not (mesh.st >= -1e-6).all() or not (mesh.st <= 1 + 1e-6).all():
        problems.append("texture coordinates outside [0, 1]")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        problems.append("faces that name vertices which are not there")
    return problems
