"""Package a sequence: choose the codecs' settings by what shows, write the levels, the sound and the pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.audio import encode_sound
from facefolds_core.asset.codecs import CODECS, Codec
from facefolds_core.asset.cropping import crop_layers
from facefolds_core.asset.filmed import filmed_view
from facefolds_core.asset.manifest import Level, Manifest, Quality
from facefolds_core.asset.manifest_extras import Audio, Photo, Poster
from facefolds_core.asset.manifest_file import MANIFEST_NAME, write_manifest
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.reflection import ReflectionPicture, reflection_entry
from facefolds_core.asset.video import decode_video, unpack_picture
from facefolds_core.asset.writer import (
    FULL,
    AssetSource,
    LevelContent,
    check_inputs,
    manifest_of,
    write_level,
)
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.export.between import at_frame_rate
from facefolds_core.export.stores import Grids
from facefolds_core.files import atomic_folder, file_sha256
from facefolds_core.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.packaging.levels import coarse_content, level_params
from facefolds_core.packaging.meshbits import resolved
from facefolds_core.packaging.poster import BACKGROUND, write_poster
from facefolds_core.packaging.rate import search_crf
from facefolds_core.packaging.views import ViewMeter, spread, training_cameras
from facefolds_core.params import CompressParams, CrfSearchParams, LevelParams, VideoCodec


@dataclass(frozen=True)
class Export:
    """What the export's earlier stages made.

    Attributes:
        meshes: N layers, outermost first.
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

    @classmethod
    def of(
        cls,
        grids: Grids,
        meshes: Sequence[TexturedMesh],
        textures: Path,
        coarser: Mapping[int, Sequence[TexturedMesh]],
    ) -> Export:
        """From what the steps of the export give; `textures` is the frame store of `bake`."""
        windows = [(float(u0), float(u1), float(v0), float(v1)) for u0, u1, v0, v1 in grids.windows]
        x, y, z = (float(value) for value in grids.centre)
        return cls(meshes, windows, FrameStore(textures), (x, y, z), coarser, grids.reflection)


def package(folder: Path, export: Export, scene: Scene, params: CompressParams) -> Manifest:
    """Write the folder of an asset, whole or not at all; an older one is replaced.

    Raises:
        UserError: if the export cannot be an asset.
    """
    _check_order(params.levels)
    frames = check_inputs(export.meshes, export.windows, export.textures)
    factor = params.frame_rate_factor if frames > 1 else 1
    track = None if scene.poses is None else scene.poses.resampled(factor)
    source = AssetSource(scene.subject, scene.fps, scene.from_capture.inverse(), export.centre, track)
    cameras = training_cameras(scene)
    with (
        atomic_folder(folder) as temporary,
        at_frame_rate(export.textures, factor, temporary, params.between) as textures,
    ):
        layers = crop_layers(export.meshes, export.windows, textures, frames * factor)
        full = LevelContent(layers, textures, frames * factor, source.fps * factor)
        meter = make_meter(full, cameras, params)
        levels = []
        for coarse in params.levels:
            content = coarse_content(full, export.windows, coarse, export.coarser[coarse.mesh_resolution])
            levels.append(_level(temporary, coarse.name, content, level_params(params, coarse), meter, cameras))
        level = _level(temporary, FULL, full, params, meter, cameras)
        if export.reflection is not None:
            picture = ReflectionPicture.of(export.reflection)
            levels = [_with_reflection(temporary, one, picture) for one in levels]
            level = _with_reflection(temporary, level, picture)
        photos = _photos(temporary, scene, params, factor)
        manifest = _with_extras(temporary, manifest_of(source, [*levels, level], temporary), scene, photos, params)
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


def make_meter(content: LevelContent, cameras: Sequence[Camera], params: CompressParams) -> ViewMeter | None:
    """The yardstick of the content's own textures and meshes; None without cameras."""
    if not cameras:
        return None
    wanted = params.meter.frames
    frames = {*spread(content.frames, wanted), *spread(min(content.frames, params.search.frames), wanted)}
    meshes = [layer.mesh for layer in content.layers]
    return ViewMeter(meshes, cameras, {frame: content.frame(frame) for frame in frames}, params.meter)


def _level(
    folder: Path,
    name: str,
    content: LevelContent,
    params: CompressParams,
    meter: ViewMeter | None,
    cameras: Sequence[Camera],
) -> Level:
    """Write a level and measure it: against the full one before coding, by `meter`."""
    params = params.model_copy(update={"mesh": resolved(params.mesh, content.layers, cameras)})
    video = params.video
    crfs = None
    if meter is not None and video.target_psnr is not None and not video.lossless:
        search, target = params.search, video.target_psnr
        crfs = {codec: _crf(folder, content, CODECS[codec], video, meter, target, search) for codec in video.codec}
    level = write_level(folder, name, content, params, crfs)
    if meter is None:
        return level
    shown = read_level(folder, level)
    psnr = meter.psnr(enumerate(shown.frames()), meter.hits(shown.layers))
    asked = None if crfs is None else video.target_psnr
    return level.model_copy(update={"quality": Quality(psnr_to_model=round(psnr, 3), target_psnr=asked)})


def _with_reflection(folder: Path, level: Level, picture: ReflectionPicture) -> Level:
    """Add the reflection to a level; each has its own copy, a few kB: a level is complete in itself."""
    path = folder / f"{level.name}_reflection.png"
    path.write_bytes(picture.png())
    entry = reflection_entry(picture, _stored(path))
    return level.model_copy(update={"reflection": entry, "bytes": level.bytes + entry.bytes})


def _crf(
    folder: Path,
    content: LevelContent,
    codec: Codec,
    video: VideoCodec,
    meter: ViewMeter,
    target: float,
    search: CrfSearchParams,
) -> int:
    layout = content.layout
    with TemporaryDirectory(dir=folder) as scratch:  # a killed run leaves nothing elsewhere
        path = Path(scratch) / f"trial.{codec.container}"

        def quality(crf: int) -> float:
            content.encode(path, codec, video, crf, min(content.frames, search.frames))
            pictures = decode_video(path, (layout.width, layout.height), float(content.rate))
            wanted = ((k, picture) for k, picture in enumerate(pictures) if k in meter.frames)
            return meter.psnr((k, unpack_picture(picture, layout)) for k, picture in wanted)

        return search_crf(quality, target, codec.crf(video.crf), codec.worst_crf, search).crf


def _with_extras(
    folder: Path, manifest: Manifest, scene: Scene, photos: Sequence[Photo], params: CompressParams
) -> Manifest:
    """Add sound, a poster, photos and the range that was filmed."""
    update: dict[str, object] = {"photos": tuple(photos)}
    if scene.audio is not None:
        path, texture = folder / "audio.m4a", manifest.full.texture
        mime = encode_sound(path, scene.audio, texture.frames / texture.fps)
        update["audio"] = Audio(**_stored(path), mime=mime)
    train = scene.indices("train")
    if train:
        unseen = [scene.cameras[index] for index in scene.indices("holdout")]
        update["view"] = filmed_view([scene.cameras[index] for index in train], unseen)
    path, first = folder / "poster.jpg", scene.cameras[0]
    side = min(params.poster_side, max(first.width, first.height))
    camera = write_poster(path, manifest, side, params.jpeg_quality)
    update["poster"] = Poster(
        **_stored(path),
        width=camera.width,
        height=camera.height,
        K=_rows(camera.K),
        w2c=_rows(camera.w2c),
        background=BACKGROUND,
    )
    return manifest.model_copy(update=update)


def _photos(folder: Path, scene: Scene, params: CompressParams, factor: int) -> list[Photo]:
    """Photos of held-out cameras, each with its own frame, spread over the sequence.

    Args:
        factor: frames of the asset a frame of the scene.
    """
    if params.photos == 0:
        return []
    store, found = scene.open_frames(), []
    keys = [key for key in store if key[0] in scene.indices("holdout")]
    for index, key in enumerate(keys[i] for i in spread(len(keys), params.photos)) if keys else ():
        path = folder / f"photo_{index:02d}.jpg"
        Image.fromarray(store.image(*key)).save(path, quality=params.jpeg_quality)
        camera = scene.cameras[key[0]]
        found.append(
            Photo(
                **_stored(path),
                width=camera.width,
                height=camera.height,
                camera=camera.name,
                frame=key[1] * factor,
                K=_rows(camera.K),
                w2c=_rows(camera.w2c),
            )
        )
    return found


def _rows(matrix: NDArray[np.float64]) -> Any:
    return tuple(tuple(float(x) for x in row) for row in matrix)


def _stored(path: Path) -> dict[str, Any]:
    return {"file": path.name, "bytes": path.stat().st_size, "sha256": file_sha256(path)}
