"""Read an asset. Nothing here knows the model: files only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.draco import DracoError, decode_mesh
from facefolds_core.asset.effects import Map, read_effects
from facefolds_core.asset.manifest import (
    MANIFEST_NAME,
    REMEDY,
    Layer,
    Level,
    Manifest,
    parse_manifest,
    seal_is_whole,
)
from facefolds_core.asset.packing import AtlasLayout, inside
from facefolds_core.asset.video import decode_video, unpack_picture
from facefolds_core.errors import UserError
from facefolds_core.files import file_sha256
from facefolds_core.geometry.meshes import TexturedMesh

Frame = tuple[NDArray[np.uint8], ...]
"""N textures (h, w, 4) RGBA, straight alpha, layers outermost first, row 0 at the top of the head."""


@dataclass(frozen=True)
class AssetLevel:
    """One level of detail of an asset; its video is decoded on demand.

    Attributes:
        folder: where the asset lies.
        entry: its part of the manifest.
        layers: N meshes, outermost first.
        video: index of the video that is decoded.
    """

    folder: Path
    entry: Level
    layers: tuple[TexturedMesh, ...]
    video: int = 0

    @property
    def num_layers(self) -> int:
        return len(self.layers)

    @property
    def num_frames(self) -> int:
        return self.entry.texture.frames

    def effects(self) -> tuple[Map, ...] | None:
        """The view effects, one map (h, w, 3, 3) a layer; None where the level has none.

        Raises:
            UserError: if their picture is damaged.
        """
        return read_effects(self.folder, self.entry)

    def frames(self) -> Iterator[Frame]:
        """All frames in order, decoded as they are asked for.

        Raises:
            UserError: if the video is damaged or has another number of frames than the manifest says.
        """
        count = 0
        for frame in self._decode(0):
            if count < self.num_frames:
                yield frame
            count += 1
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
        return self.folder / self.entry.texture.videos[self.video].file

    def _decode(self, start: int) -> Iterator[Frame]:
        texture = self.entry.texture
        layout = layout_of(self.entry)
        pictures = decode_video(self._path, (texture.width, texture.height), texture.fps, start)
        return (unpack_picture(picture, layout) for picture in pictures)

    def _wrong_count(self, found: int) -> UserError:
        return UserError(
            "the texture video has another number of frames",
            file=self._path,
            expected=self.num_frames,
            found=found,
            remedy=REMEDY,
        )


@dataclass(frozen=True)
class Asset:
    """An asset whose files have been checked against the manifest. Its own layers and frames are the full level's.

    Attributes:
        folder: where it lies.
        manifest: its manifest.
        levels: coarsest first.
    """

    folder: Path
    manifest: Manifest
    levels: tuple[AssetLevel, ...]

    @property
    def full(self) -> AssetLevel:
        return self.levels[-1]

    @property
    def layers(self) -> tuple[TexturedMesh, ...]:
        return self.full.layers

    @property
    def num_layers(self) -> int:
        return self.full.num_layers

    @property
    def num_frames(self) -> int:
        return self.full.num_frames

    def effects(self) -> tuple[Map, ...] | None:
        """As `AssetLevel.effects`."""
        return self.full.effects()

    def frames(self) -> Iterator[Frame]:
        """As `AssetLevel.frames`."""
        return self.full.frames()

    def frame(self, index: int) -> Frame:
        """As `AssetLevel.frame`."""
        return self.full.frame(index)


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
    problems = []
    if not seal_is_whole(path.read_bytes()):
        problems.append("manifest_sha256 is not this file's: its content was changed")
    for level in manifest.levels:
        problems += [f"level {level.name}: {problem}" for problem in _level_problems(level)]
    if len({level.name for level in manifest.levels}) != len(manifest.levels):
        problems.append("two levels have one name")
    if len({(level.texture.frames, level.texture.fps) for level in manifest.levels}) != 1:
        problems.append("the levels differ in frames or fps")
    rotation = np.array(manifest.coordinates.to_capture.rotation)
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-6 or np.linalg.det(rotation) < 0:
        problems.append("coordinates.to_capture.rotation is not a rotation")
    names = [MANIFEST_NAME, *(name for name, _, _ in manifest.files())]
    if len(set(names)) != len(names):
        problems.append("one file is named twice")
    return problems


def _level_problems(level: Level) -> list[str]:
    texture, effects = level.texture, level.view_effects
    problems = []
    if texture.width % 2 or texture.height % 2:
        problems.append(f"a video of {texture.width} x {texture.height} pixels: both must be even")
    problems += layout_of(level).problems()
    for index, (u0, u1, v0, v1) in enumerate(layer.uv_window for layer in level.layers):
        if not (u0 < u1 and v0 < v1):
            problems.append(f"uv_window {[u0, u1, v0, v1]} of layer {index} is empty")
    if level.bytes != (total := sum(size for _, size, _ in level.files())):
        problems.append(f"bytes are {level.bytes}, those of its files are {total}")
    rects = [layer.effects_rect for layer in level.layers if layer.effects_rect is not None]
    if effects is None:
        return problems + ["effects_rects without view_effects"] * bool(rects)
    if len(rects) != len(level.layers):
        problems.append("view_effects, but a layer without effects_rect")
    planes = effects.planes
    if any(plane[2:] != planes[0][2:] for plane in planes):
        problems.append("the planes of view_effects differ in size")
    problems += [
        f"plane {list(p)} is not inside the effects picture"
        for p in planes
        if not inside(p, (effects.width, effects.height))
    ]
    problems += [f"effects_rect {list(r)} is not inside its plane" for r in rects if not inside(r, planes[0][2:])]
    return problems


def check_file(path: Path, size: int, sha256: str) -> str | None:
    """What is wrong with a file against the manifest's byte count and checksum, in words; None if it is whole."""
    if not path.is_file():
        return "the file is missing"
    found = path.stat().st_size
    if found != size:
        return f"the file has {found} bytes, the manifest says {size}: " + ("truncated" if found < size else "too long")
    if file_sha256(path) != sha256:
        return "the file's SHA-256 is not the manifest's: its content was changed"
    return None


def read_asset(folder: str | Path) -> Asset:
    """Read the manifest and the meshes of all levels; check every file's length and checksum.

    Raises:
        UserError: if anything is missing, damaged or of another version; names the file.
    """
    folder = Path(folder)
    if not folder.is_dir():
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
    return Asset(folder, manifest, tuple(read_level(folder, level) for level in manifest.levels))


def read_level(folder: Path, level: Level) -> AssetLevel:
    """One level of an asset, its meshes decoded.

    Raises:
        UserError: if a mesh is damaged.
    """
    return AssetLevel(folder, level, tuple(_read_layer(folder, layer) for layer in level.layers))


def _read_layer(folder: Path, layer: Layer) -> TexturedMesh:
    try:
        mesh = decode_mesh((folder / layer.mesh).read_bytes())
    except DracoError as error:
        raise UserError("damaged mesh", file=folder / layer.mesh, found=str(error), remedy=REMEDY) from None
    problems = mesh_problems(mesh, layer.vertices, layer.triangles)
    if problems:
        raise UserError("damaged mesh", file=folder / layer.mesh, found="; ".join(problems), remedy=REMEDY)
    return mesh


def mesh_problems(mesh: TexturedMesh, vertices: int, triangles: int) -> list[str]:
    """What makes a decoded mesh unusable or different from its manifest's counts, in words."""
    problems = []
    if len(mesh.vertices) != vertices:
        problems.append(f"{len(mesh.vertices)} vertices, the manifest says {vertices}")
    if len(mesh.faces) != triangles:
        problems.append(f"{len(mesh.faces)} triangles, the manifest says {triangles}")
    if not np.isfinite(mesh.vertices).all():
        problems.append("vertices that are not finite")
    if not (mesh.st >= -1e-6).all() or not (mesh.st <= 1 + 1e-6).all():
        problems.append("texture coordinates outside [0, 1]")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        problems.append("faces that name vertices which are not there")
    return problems
