"""Read an asset. Nothing here knows the model: files only.

Nothing is decoded whose bytes are not the manifest's: a file that is changed after the asset was opened is refused too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.checks import layout_of, manifest_problems, mesh_problems
from facefolds_core.asset.draco import DracoError, decode_mesh
from facefolds_core.asset.manifest import REMEDY, Layer, Level, Manifest
from facefolds_core.asset.manifest_file import MANIFEST_NAME, parse_manifest
from facefolds_core.asset.reflection import read_reflection
from facefolds_core.asset.segments import decode_segments
from facefolds_core.asset.stored import check_file, read_slice, refuse_changed
from facefolds_core.asset.track_file import read_track
from facefolds_core.asset.video import Picture, decode_video, unpack_picture
from facefolds_core.errors import UserError
from facefolds_core.files.reading import is_folder
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.geometry.track import Track

Frame = tuple[NDArray[np.uint8], ...]
"""N textures (h, w, 4) RGBA, straight alpha, layers outermost first, row 0 at the top of the head."""


@dataclass(frozen=True)
class AssetLevel:
    """One level of detail of an asset; its first video is decoded on demand.

    Attributes:
        folder: where the asset lies.
        entry: its part of the manifest.
        layers: N meshes, outermost first.
        track: the meshes' motion as a whole; None where they stand still.
    """

    folder: Path
    entry: Level
    layers: tuple[TexturedMesh, ...]
    track: Track | None = None

    @property
    def num_layers(self) -> int:
        return len(self.layers)

    @property
    def num_frames(self) -> int:
        return self.entry.texture.frames

    def reflection(self) -> ReflectionMaps | None:
        """The reflection that all layers and frames share; None where the level has none.

        Raises:
            UserError: if its picture is damaged.
        """
        return read_reflection(self.folder, self.entry)

    @property
    def windows(self) -> list[Window]:
        """(u0, u1, v0, v1) of each layer's texture coordinates."""
        return [layer.uv_window for layer in self.entry.layers]

    def frames(self) -> Iterator[Frame]:
        """All frames in order, decoded as they are asked for.

        Raises:
            UserError: if the video is damaged or has another number of frames than the manifest says.
        """
        count = 0
        for count, frame in enumerate(self._decode(0), 1):
            if count <= self.num_frames:
                yield frame
        if count != self.num_frames:
            raise self._wrong_count(count)

    def frame(self, index: int) -> Frame:
        """Frame `index`, 0 <= index < num_frames, whatever was read before.

        Raises:
            IndexError: if there is no such frame.
            UserError: if the video is damaged.
        """
        if not 0 <= index < self.num_frames:
            raise IndexError(f"frame {index} of {self.num_frames}")
        found = next(islice(self._decode(index), 1), None)
        if found is None:
            raise self._wrong_count(index)
        return found

    @property
    def _path(self) -> Path:
        return self.folder / self.entry.texture.videos[0].file

    def pictures(self, start: int = 0) -> Iterator[Picture]:
        """The video's planar pictures from frame `start` on, decoded as they are asked for.

        Raises:
            UserError: if the video is damaged, or not the one that the manifest names.
        """
        texture = self.entry.texture
        video = texture.videos[0]
        if video.segments is not None:
            return decode_segments(self.folder, video, texture, start)
        refuse_changed(self.folder, video)
        return decode_video(self._path, (texture.width, texture.height), texture.fps, start)

    def _decode(self, start: int) -> Iterator[Frame]:
        layout = layout_of(self.entry)
        return (unpack_picture(picture, layout) for picture in self.pictures(start))

    def _wrong_count(self, found: int) -> UserError:
        return UserError(
            "the texture video has another number of frames",
            file=self._path,
            expected=self.num_frames,
            found=found,
            remedy=REMEDY,
        )


@dataclass(frozen=True, kw_only=True)
class Asset(AssetLevel):
    """An asset whose files have been checked against the manifest: its full level, and what else there is.

    Attributes:
        manifest: its manifest.
        levels: coarsest first.
    """

    manifest: Manifest
    levels: tuple[AssetLevel, ...]

    @property
    def full(self) -> AssetLevel:
        return self.levels[-1]


def read_asset(folder: str | Path) -> Asset:
    """Read the manifest and the meshes of all levels; check every file's length and checksum.

    Raises:
        UserError: if anything is missing, damaged or of another version; names the file.
    """
    folder = Path(folder)
    if not is_folder(folder):
        raise UserError("no such folder", file=folder, expected="an asset's folder", remedy="make it with `dvc repro`")
    path = folder / MANIFEST_NAME
    manifest = parse_manifest(path)
    problems = manifest_problems(path, manifest)
    if problems:
        raise UserError("damaged manifest", file=path, found="; ".join(problems), remedy=REMEDY)
    for name, size, sha256 in manifest.files():
        problem = check_file(folder / name, size, sha256)
        if problem:
            raise UserError("damaged asset", file=folder / name, found=problem, remedy=REMEDY)
    track = read_track(folder, manifest)
    levels = tuple(read_level(folder, level, track) for level in manifest.levels)
    return Asset(**vars(levels[-1]), manifest=manifest, levels=levels)


def read_level(folder: Path, level: Level, track: Track | None = None) -> AssetLevel:
    """One level of an asset, its meshes decoded.

    Args:
        track: of the asset.

    Raises:
        UserError: if a mesh is damaged.
    """
    for file in level.meshes:
        refuse_changed(folder, file)
    layers = tuple(_read_layer(folder, layer, f"layer {index}") for index, layer in enumerate(level.layers))
    return AssetLevel(folder, level, layers, track=track)


def layer_bytes(folder: Path, layer: Layer) -> bytes:
    """The Draco mesh of a layer as it is stored.

    Raises:
        UserError: if its bytes are not the manifest's.
    """
    return read_slice(folder / layer.mesh, layer.offset, layer.bytes, layer.sha256)


def _read_layer(folder: Path, layer: Layer, place: str) -> TexturedMesh:
    path = folder / layer.mesh
    try:
        mesh = decode_mesh(layer_bytes(folder, layer))
    except DracoError as error:
        raise UserError("damaged mesh", file=path, place=place, found=str(error), remedy=REMEDY) from None
    problems = mesh_problems(mesh, layer.vertices, layer.triangles)
    if problems:
        raise UserError("damaged mesh", file=path, place=place, found="; ".join(problems), remedy=REMEDY)
    return mesh
