"""Write an asset: Draco meshes, texture video, manifest."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core import __version__
from facefolds_core.asset.codecs import CODECS, Codec, CodecName, VideoSettings
from facefolds_core.asset.cropping import CroppedLayer, TextureFrames
from facefolds_core.asset.draco import MeshSettings, encode_mesh
from facefolds_core.asset.manifest import (
    Bounds,
    Coordinates,
    Layer,
    Level,
    Manifest,
    Texture,
    Transform,
    Video,
)
from facefolds_core.asset.manifest_base import StoredFile
from facefolds_core.asset.manifest_extras import StandingTorso
from facefolds_core.asset.packing import AtlasLayout, check_layout
from facefolds_core.asset.parts import encode_parts
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.regions import Region
from facefolds_core.asset.stored import stored_file
from facefolds_core.asset.track_file import write_track
from facefolds_core.asset.video import key_frames, pack_frame, probe_video
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track

STATIC_FPS = 1.0
"""Written for a static scene, whose one frame has no rate."""
FULL = "full"
"""Name of the level that holds everything."""


@dataclass(frozen=True)
class AssetSource:
    """What a manifest tells of the capture.

    Attributes:
        subject: its name.
        fps: frames a second; 0 for a static scene.
        to_capture: normalised coordinates -> capture coordinates.
        sphere_centre: c of the UV map, normalised.
        track: the meshes' motion as a whole, at the asset's frame rate; None where they stand still.
    """

    subject: str
    fps: float
    to_capture: Similarity
    sphere_centre: tuple[float, float, float]
    track: Track | None = None


def manifest_of(source: AssetSource, levels: Sequence[Level], folder: Path) -> Manifest:
    """A manifest without sound and pictures, of levels whose files lie in `folder`; writes the track there."""
    corners = [mesh.vertices for level in levels for mesh in read_level(folder, level).layers]
    low, high = (np.stack([pick(vertices, 0) for vertices in corners]) for pick in (np.min, np.max))
    manifest = Manifest(
        generator=f"facefolds {__version__}",
        subject=source.subject,
        coordinates=Coordinates(to_capture=Transform.of(source.to_capture), sphere_centre=source.sphere_centre),
        bounds=Bounds(min=tuple(low.min(0).tolist()), max=tuple(high.max(0).tolist())),
        levels=tuple(levels),
    )
    if source.track is None:
        return manifest
    torso = None if source.track.torso is None else StandingTorso.of(source.track.torso)
    return manifest.model_copy(update={"track_file": write_track(folder, source.track), "torso": torso})


@dataclass(frozen=True)
class LevelContent:
    """What a level shows, before coding.

    Attributes:
        layers: outermost first.
        textures: of which the layers' crops ship.
        frames: K.
        fps: frames a second; 0 for a static scene.
        unit: the layout can be scaled down by it and its divisors; one of the crops' numbers.
        placed: the layout, where it is not to be chosen.
        part_frames: frames that are encoded by themselves, each a group of pictures; 0: all of them at once.
    """

    layers: Sequence[CroppedLayer]
    textures: TextureFrames
    frames: int
    fps: float
    unit: int = 1
    placed: AtlasLayout | None = None
    part_frames: int = 0

    @cached_property
    def layout(self) -> AtlasLayout:
        """Where the layers lie in the picture.

        Raises:
            UserError: if they do not fit into one.
        """
        if self.placed is not None:
            return self.placed
        layout = AtlasLayout.pack([layer.crop[2:] for layer in self.layers], self.unit)
        check_layout(layout, self.textures.image(self.layers[0].source, 0).shape[0])
        return layout

    @property
    def rate(self) -> Fraction:
        return Fraction(self.fps or STATIC_FPS).limit_denominator(1001)

    def frame(self, index: int) -> list[NDArray[np.uint8]]:
        """The layers' textures, N of (h, w, 4)."""
        return [layer.cut(self.textures.image(layer.source, index)) for layer in self.layers]

    def encode(
        self,
        path: Path,
        codec: Codec,
        params: VideoSettings,
        crf: int,
        frames: int | None = None,
        regions: Sequence[Region] = (),
    ) -> None:
        """Encode the first `frames` pictures (all by default); `crf` on the encoder's own scale."""
        count, layout = self.frames if frames is None else frames, self.layout
        options = codec.options(params, crf)
        step = self.part_frames if self.part_frames and frames is None else count
        encode_parts(
            path,
            lambda k: pack_frame(self.frame(k), layout),
            [*range(0, count, step), count],
            (layout.width, layout.height),
            self.rate,
            codec,
            codec.of_part(options) if self.part_frames else options,
            regions if codec.regions else (),
        )


def write_level(
    folder: Path,
    name: str,
    content: LevelContent,
    mesh: MeshSettings,
    video: VideoSettings,
    crfs: Mapping[CodecName, int] | None = None,
    shared: Level | None = None,
    regions: Sequence[Region] = (),
    encoded: Mapping[CodecName, Path] | None = None,
) -> Level:
    """Write the files of one level into `folder`: NAME_meshes.bin, NAME.mp4 ...; returns its part of the manifest.

    Args:
        crfs: codec -> factor on the encoder's own scale; by default what `video.crf` means for it.
        shared: a level of the same layers whose meshes are this one's, too.
        regions: of the picture, coded finer or coarser.
        encoded: videos that are made already.

    Raises:
        UserError: if the textures do not fit into one video, or an encoder refuses them.
    """
    layout = content.layout
    if shared is None:
        meshes, entries = _write_layers(folder / f"{name}_meshes.bin", content.layers, layout, mesh)
    else:
        meshes = shared.meshes[0]
        pairs = zip(shared.layers, layout.rects, strict=True)
        entries = tuple(layer.model_copy(update={"texture_rect": rect}) for layer, rect in pairs)
    videos = []
    for codec in (CODECS[codec] for codec in video.codec):
        path = folder / f"{name}.{codec.container}"
        # Two codecs may share a container: the first has the plain name.
        path = path if not path.exists() else path.with_name(f"{name}_{codec.name}.{codec.container}")
        if encoded and codec.name in encoded:
            shutil.copyfile(encoded[codec.name], path)
        else:
            crf = crfs[codec.name] if crfs else codec.crf(video.crf)
            content.encode(path, codec, video, crf, regions=regions)
        stored, facts = stored_file(path).model_dump(), probe_video(path)
        one = Video(**stored, container=codec.container, codec=codec.name, mime=facts.mime, level=facts.level)
        videos.append(one)
    texture = Texture(
        width=layout.width,
        height=layout.height,
        colour_rect=layout.colour_rect,
        alpha_rect=layout.alpha_rect,
        frames=content.frames,
        frame_rate=content.rate.as_integer_ratio(),
        keyframes=tuple(sorted(set.intersection(*(set(key_frames(folder / one.file)) for one in videos)))),
        videos=tuple(videos),
    )
    size = meshes.bytes + sum(one.bytes for one in videos)
    return Level(name=name, meshes=(meshes,), layers=entries, texture=texture, bytes=size)


def _write_layers(
    path: Path, layers: Sequence[CroppedLayer], layout: AtlasLayout, settings: MeshSettings
) -> tuple[StoredFile, tuple[Layer, ...]]:
    """All meshes of a level in one file, one after the other: a player asks for it once."""
    entries, content = [], bytearray()
    for layer, rect in zip(layers, layout.rects, strict=True):
        data, decoded = encode_mesh(layer.mesh, settings)
        entry = Layer(
            mesh=path.name,
            offset=len(content),
            vertices=len(decoded.vertices),
            triangles=len(decoded.faces),
            bytes=len(data),
            sha256=hashlib.sha256(data).hexdigest(),
            texture_rect=rect,
            uv_window=layer.window,
        )
        entries.append(entry)
        content += data
    path.write_bytes(content)
    whole = StoredFile(file=path.name, bytes=len(content), sha256=hashlib.sha256(content).hexdigest())
    return whole, tuple(entries)
