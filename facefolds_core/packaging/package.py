"""Package a sequence: choose the codecs' settings by what shows, write the levels, the sound and the pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from PIL import Image

from facefolds_core.asset.audio import encode_sound
from facefolds_core.asset.cropping import crop_layers
from facefolds_core.asset.filmed import filmed_view
from facefolds_core.asset.inputs import check_textures
from facefolds_core.asset.manifest import Level, Manifest, Reflection
from facefolds_core.asset.manifest_extras import Audio, Photo, Poster
from facefolds_core.asset.manifest_file import MANIFEST_NAME, write_manifest
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.reflection import pack_reflection
from facefolds_core.asset.stored import stored_file
from facefolds_core.asset.streams import make_streams
from facefolds_core.asset.track_file import read_track
from facefolds_core.asset.writer import FULL, AssetSource, LevelContent, manifest_of
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.files.writing import atomic_folder
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.packaging.coding import coded_level, make_meter
from facefolds_core.packaging.levels import coarse_content, is_streamed, stream_unit, write_rungs
from facefolds_core.packaging.limits import good_view
from facefolds_core.packaging.poster import BACKGROUND, JPEG_QUALITY, write_poster
from facefolds_core.packaging.settings import level_params
from facefolds_core.params import CompressParams, LevelParams
from facefolds_core.spacing import spread

POSTER_SIDE = 720
"""Longer side of the poster, pixels; no more than the capture's pictures have."""


@dataclass(frozen=True)
class Export:
    """What the export's earlier stages made.

    Attributes:
        meshes: N layers, outermost first, as `read_meshes` checked them.
        windows: of each layer's texture.
        textures: layered store, N layers x K frames of (R, R, 4).
        centre: c of the UV map, units.
        reflection: what the model adds by the direction, or None.
        coarser: R^m -> the layers with at most R^m x R^m vertices, for the coarser levels.
    """

    meshes: Sequence[TexturedMesh]
    windows: Sequence[Window]
    textures: FrameStore
    centre: tuple[float, float, float]
    coarser: Mapping[int, Sequence[TexturedMesh]]
    reflection: ReflectionMaps | None = None


def package(folder: Path, export: Export, scene: Scene, params: CompressParams) -> Manifest:
    """Write the folder of an asset, whole or not at all; an older one is replaced.

    Raises:
        UserError: if the export cannot be an asset.
    """
    _check_order(params.levels)
    frames = check_textures(export.textures, len(export.meshes))
    source = AssetSource(scene.subject, scene.fps, scene.from_capture.inverse(), export.centre, scene.poses)
    cameras, textures = scene.views_of("train"), export.textures
    with atomic_folder(folder) as temporary:
        streamed = is_streamed(params.stream, frames, source.fps)
        unit = stream_unit(params.levels, textures.image(0, 0).shape[0]) if streamed else 1
        layers = crop_layers(export.meshes, export.windows, textures, frames, unit)
        full = LevelContent(layers, textures, frames, source.fps, unit)
        meter = make_meter(full, cameras)
        if streamed:
            levels = write_rungs(temporary, full, params, meter, cameras)
        else:
            levels = []
            for coarse in params.levels:
                content = coarse_content(full, export.windows, coarse, export.coarser[coarse.mesh_resolution])
                coded = coded_level(temporary, coarse.name, content, level_params(params, coarse), meter, cameras)
                levels.append(coded)
            levels.append(coded_level(temporary, FULL, full, level_params(params), meter, cameras))
        if export.reflection is not None:
            packed = pack_reflection(export.reflection)
            levels = [_with_reflection(temporary, one, *packed) for one in levels]
        photos = _photos(temporary, scene, params)
        manifest = _with_extras(temporary, manifest_of(source, levels, temporary), scene, photos)
        if streamed:
            made, sound, stream = make_streams(temporary, manifest.levels, manifest.audio)
            manifest = manifest.model_copy(update={"levels": tuple(made), "audio": sound, "stream": stream})
        return write_manifest(manifest, temporary / MANIFEST_NAME)


def _check_order(levels: Sequence[LevelParams]) -> None:
    """Refuse levels that are clearly not in the format's order, which readers would refuse."""
    for coarse, fine in pairwise(levels):
        if coarse.mesh_resolution > fine.mesh_resolution and coarse.texture_resolution > fine.texture_resolution:
            raise UserError(
                "the levels of detail are in the wrong order",
                place=f"compress.levels: {coarse.name}, {fine.name}",
                expected="the coarsest first",
                remedy="change their order in params.yaml",
            )


def _with_reflection(folder: Path, level: Level, png: bytes, said: dict[str, Any]) -> Level:
    """Add the reflection to a level; each has its own copy, a few kB: a level is complete in itself."""
    path = folder / f"{level.name}_reflection.png"
    path.write_bytes(png)
    entry = Reflection(**stored_file(path).model_dump(), **said)
    return level.model_copy(update={"reflection": entry, "bytes": level.bytes + entry.bytes})


def _with_extras(folder: Path, manifest: Manifest, scene: Scene, photos: Sequence[Photo]) -> Manifest:
    """Add sound, a poster, photos and the range that was filmed."""
    update: dict[str, object] = {"photos": tuple(photos)}
    if scene.audio is not None:
        path, texture = folder / "audio.m4a", manifest.full.texture
        mime = encode_sound(path, scene.audio, texture.frames / texture.fps)
        update["audio"] = Audio(**stored_file(path).model_dump(), mime=mime)
    level, train = read_level(folder, manifest.full, read_track(folder, manifest)), scene.indices("train")
    if train:
        unseen = [scene.cameras[index] for index in scene.indices("holdout")]
        view = filmed_view([scene.cameras[index] for index in train], unseen)
        if view is not None:
            view = view.model_copy(update={"good": good_view(level, view)})
        update["view"] = view
    path, first = folder / "poster.jpg", scene.cameras[0]
    side = min(POSTER_SIDE, max(first.width, first.height))
    assert manifest.bounds is not None
    camera = write_poster(path, level, manifest.bounds, side)
    update["poster"] = Poster(**stored_file(path).model_dump(), **_taken_by(camera), background=BACKGROUND)
    return manifest.model_copy(update=update)


def _photos(folder: Path, scene: Scene, params: CompressParams) -> list[Photo]:
    """Photos of held-out cameras, each with its own frame, spread over the sequence."""
    if params.photos == 0:
        return []
    store, found = scene.open_frames(), []
    keys = [key for key in store if key[0] in scene.indices("holdout")]
    for index, key in enumerate(spread(keys, params.photos)):
        path = folder / f"photo_{index:02d}.jpg"
        Image.fromarray(store.image(*key)).save(path, quality=JPEG_QUALITY)
        camera = scene.cameras[key[0]]
        stored = stored_file(path).model_dump()
        found.append(Photo(**stored, **_taken_by(camera), camera=camera.name, frame=key[1]))
    return found


def _taken_by(camera: Camera) -> dict[str, Any]:
    """What a manifest says of a picture's size and camera."""
    K, w2c = (tuple(map(tuple, matrix.tolist())) for matrix in (camera.K, camera.w2c))
    return {"width": camera.width, "height": camera.height, "K": K, "w2c": w2c}
