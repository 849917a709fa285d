"""An asset's level as one GLB with the extension: layers and video as the asset has them, a still for other viewers.

The still is plain, so that every viewer opens it: nothing is required. It may be of a coarser level, since in the full
one it has several times the bytes of all else. The layers, which only readers of the extension
decode, are the asset's own Draco meshes: bytes compared in docs/research/engines.md.
"""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.audio import AAC_MIME, encode_sound
from facefolds_core.asset.draco import attribute_ids
from facefolds_core.asset.glb import (
    ARRAY_BUFFER,
    ELEMENT_ARRAY_BUFFER,
    FLOAT,
    UNLIT,
    UNSIGNED_INT,
    Builder,
    Triangles,
    picture_of,
    png,
    pose_of,
    posed,
    triangles_of,
    write_document,
)
from facefolds_core.asset.gltf.extension import (
    DRACO,
    NAME,
    TEXTURE_VIDEO,
    Checksum,
    LayeredVideo,
    NodeTorso,
    Reflection,
)
from facefolds_core.asset.manifest import Video
from facefolds_core.asset.manifest_base import StoredFile
from facefolds_core.asset.manifest_extras import Audio
from facefolds_core.asset.opaque import opaque_where_covered
from facefolds_core.asset.reader import AssetLevel, layer_bytes
from facefolds_core.asset.stored import read_slice
from facefolds_core.asset.streams import copy_packets
from facefolds_core.asset.video import written
from facefolds_core.geometry.reflections import window_to_window
from facefolds_core.geometry.track import Track

UNSIGNED_SHORT = 5123
PLAYS_ANYWHERE = "h264"
STILL, LAYERS = 0, 1
"""Indices of the meshes."""
VIDEO, MAPS = 1, 2
"""Indices of the textures; the still's is 0."""


def write_layered(
    path: Path,
    level: AssetLevel,
    name: str,
    still: int = 0,
    fallback: AssetLevel | None = None,
    sound: Audio | None = None,
) -> int:
    """Write a level; returns the bytes of the file.

    Args:
        name: of the root node.
        still: the frame that viewers without the extension show.
        fallback: the level of the same asset that they show; by default that of the layers.
        sound: of the asset.

    Raises:
        IndexError: if there is no such frame.
        UserError: if the asset is damaged.
    """
    shown = posed(level if fallback is None else fallback, still)
    textures = opaque_where_covered(shown.frame(still), shown.windows)
    builder = Builder()
    meshes = [_still(builder, triangles_of(shown, textures)), _layers(builder, level)]
    images = [_image(builder, "still", png(picture_of(shown, textures)))]
    document_textures: list[dict[str, Any]] = [
        {"source": 0, "sampler": 0},
        {"sampler": 0, "extensions": {TEXTURE_VIDEO: {"source": 0, "autoplay": True, "loop": True}}},
    ]
    maps = level.entry.reflection
    if maps is not None:
        images.append(_image(builder, "reflection", _stored(level, maps)))
        document_textures.append({"source": 1, "sampler": 0})
    node: dict[str, Any] = {"name": "layers", "mesh": STILL}
    moved = {}
    if level.track is not None:
        node |= pose_of(level.track, still)
        moved = {"animations": [_animation(builder, level.track, level.entry.texture.fps)]}
    videos = [_video(builder, level, sound)]
    said = _said(level, still).model_copy(update={"checksums": _checksums(builder)})
    node["extensions"] = {NAME: said.model_dump(mode="json", exclude_none=True)}
    return write_document(
        path,
        name,
        builder,
        [node],
        extensionsUsed=[UNLIT, DRACO, TEXTURE_VIDEO, NAME],
        meshes=meshes,
        textures=document_textures,
        images=images,
        extensions={TEXTURE_VIDEO: {"videos": videos}},
        **moved,
    )


def _checksums(builder: Builder) -> tuple[Checksum, ...]:
    """Of all that was stored so far."""
    parts = [builder.binary[view["byteOffset"] :][: view["byteLength"]] for view in builder.views]
    return tuple(Checksum(buffer_view=i, sha256=sha256(part).hexdigest()) for i, part in enumerate(parts))


def _video(builder: Builder, level: AssetLevel, sound: Audio | None) -> dict[str, Any]:
    """The entry of the video, with the sound in it."""
    texture = level.entry.texture
    video = next((one for one in texture.videos if one.codec == PLAYS_ANYWHERE), texture.videos[0])
    data = _stored(level, video)
    if sound is None:
        return {"bufferView": builder.view(data), "mimeType": video.mime}
    _stored(level, sound)
    codec, heard = (mime.partition('codecs="')[2].rstrip('"') for mime in (video.mime, AAC_MIME))
    mime = f'video/mp4; codecs="{codec}, {heard}"'
    return {"bufferView": builder.view(_with_sound(level, video, sound)), "mimeType": mime}


def _with_sound(level: AssetLevel, video: Video, sound: Audio) -> bytes:
    """An MP4 with the pictures as they are, and the sound, as it is if it is AAC: readers play them in step.

    Raises:
        UserError: if the sound cannot be read.
    """
    texture, heard = level.entry.texture, level.folder / sound.file
    with TemporaryDirectory() as folder:
        encoded, joined = (Path(folder) / name for name in ("sound.mp4", "joined.mp4"))
        if sound.mime != AAC_MIME:
            encode_sound(encoded, heard, texture.frames / texture.fps)
            heard = encoded
        with written(joined, "mp4") as made:
            copy_packets(made, [level.folder / video.file, heard], texture.rate)
        return joined.read_bytes()


def _said(level: AssetLevel, still: int) -> LayeredVideo:
    texture, maps = level.entry.texture, level.entry.reflection
    return LayeredVideo(
        mesh=LAYERS,
        textures=(VIDEO,),
        width=texture.width,
        height=texture.height,
        color_rectangle=texture.colour_rect,
        alpha_rectangle=texture.alpha_rect,
        rectangles=tuple(layer.texture_rect for layer in level.entry.layers),
        frames=texture.frames,
        frame_rate=texture.frame_rate,
        still_frame=still,
        animation=None if level.track is None else 0,
        torso=None if level.track is None else _torso(level.track),
        reflection=None
        if maps is None
        else Reflection(
            texture=MAPS,
            transforms=tuple(window_to_window(window, maps.uv_window) for window in level.windows),
            environment_rectangle=maps.environment_rect,
            gloss_rectangle=maps.gloss_rect,
            offset_rectangle=maps.offset_rect,
            normals_rectangle=maps.normals_rect,
            environment_scale=maps.environment_scale,
            gloss_scale=maps.gloss_scale,
            offset_scale=maps.offset_scale,
        ),
    )


def _torso(track: Track) -> NodeTorso | None:
    """What stays while the animation moves the node."""
    one = track.torso
    if one is None:
        return None
    w, x, y, z = one.quaternion
    return NodeTorso(
        normal=one.normal, offset=one.offset, band=one.band, rotation=(x, y, z, w), translation=one.translation
    )


def _still(builder: Builder, triangles: Triangles) -> dict[str, Any]:
    """What viewers show that do not know the extension."""
    used, places = np.unique(np.concatenate([triangles.core, triangles.shell]), return_inverse=True)
    attributes = {
        "POSITION": builder.array("VEC3", triangles.vertices[used], bounds=True),
        "TEXCOORD_0": _shares(builder, triangles.st[used]),
    }
    parts = np.split(places.reshape(-1, 3), [len(triangles.core)])
    kind, component = ("<u2", UNSIGNED_SHORT) if len(used) < 65536 else ("<u4", UNSIGNED_INT)
    primitives = []
    for material, part in enumerate(parts):
        if len(part):
            values = part.astype(kind).ravel()
            view = builder.view(values.tobytes(), ELEMENT_ARRAY_BUFFER)
            indices = builder.accessor("SCALAR", component, values, view)
            primitives.append({"attributes": attributes, "indices": indices, "material": material})
    return {"name": "still", "primitives": primitives}


def _layers(builder: Builder, level: AssetLevel) -> dict[str, Any]:
    """Of every layer its Draco mesh."""
    primitives = []
    for mesh, entry in zip(level.layers, level.entry.layers, strict=True):
        data = layer_bytes(level.folder, entry)
        corners = {"min": mesh.vertices.min(0).tolist(), "max": mesh.vertices.max(0).tolist()}
        kinds = {"POSITION": ("VEC3", corners), "TEXCOORD_0": ("VEC2", {})}
        attributes = {
            name: builder.describe(kind, FLOAT, len(mesh.vertices), **bounds) for name, (kind, bounds) in kinds.items()
        }
        compressed = {"bufferView": builder.view(data), "attributes": attribute_ids(data)}
        primitives.append(
            {
                "attributes": attributes,
                "indices": builder.describe("SCALAR", UNSIGNED_INT, mesh.faces.size),
                "extensions": {DRACO: compressed},
            }
        )
    return {"name": "layers", "primitives": primitives}


def _shares(builder: Builder, st: NDArray[np.float64]) -> int:
    """Places (V, 2) in [0, 1] in 16 bits: off by a sixtieth of a pixel where the picture has 2000."""
    values = np.rint(np.clip(st, 0, 1) * 65535).astype("<u2")
    view = builder.view(values.tobytes(), ARRAY_BUFFER)
    return builder.accessor("VEC2", UNSIGNED_SHORT, values, view, normalized=True)


def _animation(builder: Builder, track: Track, fps: float) -> dict[str, Any]:
    """The poses at the times of the pictures, of node 0."""
    times = builder.array("SCALAR", np.arange(len(track)) / fps, bounds=True, target=None)
    parts = {
        "rotation": builder.array("VEC4", track.quaternions[:, [1, 2, 3, 0]], target=None),
        "translation": builder.array("VEC3", track.translations, target=None),
    }
    return {
        "name": "track",
        "samplers": [{"input": times, "output": output, "interpolation": "LINEAR"} for output in parts.values()],
        "channels": [{"sampler": i, "target": {"node": 0, "path": path}} for i, path in enumerate(parts)],
    }


def _image(builder: Builder, name: str, data: bytes) -> dict[str, Any]:
    return {"name": name, "mimeType": "image/png", "bufferView": builder.view(data)}


def _stored(level: AssetLevel, entry: StoredFile) -> bytes:
    """A file of the asset.

    Raises:
        UserError: if it is not what the manifest says.
    """
    return read_slice(level.folder / entry.file, 0, entry.bytes, entry.sha256)
