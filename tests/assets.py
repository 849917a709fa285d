"""A small synthetic asset: nested caps of spheres about the sphere centre, with procedural textures that move."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset import Asset, Manifest, read_asset
from facefolds_core.asset.cropping import CroppedLayer, crop_layers
from facefolds_core.asset.inputs import check_textures
from facefolds_core.asset.manifest_file import MANIFEST_NAME, write_manifest
from facefolds_core.asset.writer import FULL, AssetSource, LevelContent, manifest_of, write_level
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.files.writing import atomic_folder
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import Window, st_to_uv, uv_to_directions
from facefolds_core.geometry.torso import Torso
from facefolds_core.geometry.track import Track
from facefolds_core.params import CompressParams, MeshCodec, VideoCodec
from tests.geometry.test_track import SHIFTS, TURNS

CENTRE = (-0.25, 0.0, 0.0)
WINDOW: Window = (-0.5, 0.5, -0.4, 0.4)
SOURCE = AssetSource(
    "caps", 30.0, Similarity(2.0, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.1, 0.2, 0.3])), CENTRE
)
TRACK = Track.of(TURNS, SHIFTS)
MOVING = replace(SOURCE, track=TRACK)
"""A head that moves, for three frames."""
TORSO = Torso.at([0.0, 0.0, -1.0], -0.05, 0.1, TRACK.at(1))
OVER_TORSO = replace(SOURCE, track=replace(TRACK, torso=TORSO))
"""One that moves over a torso that stays."""

PLAIN = CompressParams(
    mesh=MeshCodec(max_error_pixels=None, compression_level=0),
    video=VideoCodec(target_psnr=None, preset="slow"),
    levels=(),
)
"""Exact floats, one level, a fixed factor: nothing is searched for."""


def radius_of(layer: int) -> float:
    """Radius of a layer's sphere; outermost first."""
    return 0.40 - 0.03 * layer


def cap_mesh(radius: float, vertices_a_side: int = 12, window: Window = WINDOW) -> TexturedMesh:
    """A grid over `window` on the sphere of `radius` about CENTRE; faces turn counter-clockwise seen from outside."""
    n = vertices_a_side
    s, t = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    st = np.stack([s, t], -1).reshape(-1, 2)
    points = np.array(CENTRE) + radius * uv_to_directions(st_to_uv(st, window))
    return TexturedMesh(points.astype(np.float32), grid_faces(n), st.astype(np.float32))


def grid_faces(n: int) -> NDArray[np.int32]:
    """(2 (n - 1)^2, 3) over n x n vertices, row by row."""
    index = np.arange(n * n, dtype=np.int32).reshape(n, n)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    return np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])


@dataclass(frozen=True)
class Meshes:
    """For casts of rays, which look at no texture."""

    layers: list[TexturedMesh]

    def frame(self, k: int) -> NDArray[np.uint8]:
        raise NotImplementedError


def cap_texture(layer: int, frame: int, resolution: int) -> NDArray[np.uint8]:
    """(R, R, 4) RGBA: smooth waves that move with the frame, alpha from 0 at the rim to 255 in the middle."""
    s, t = np.meshgrid(*[(np.arange(resolution) + 0.5) / resolution] * 2)
    phase = 0.4 * frame + layer
    red = 0.6 + 0.3 * np.sin(9 * s + 4 * t + phase)
    green = 0.45 + 0.25 * np.sin(7 * t - phase)
    blue = 0.4 + 0.2 * np.cos(8 * (s - t) + phase)
    alpha = np.clip(1.6 - 3.2 * np.hypot(s - 0.5, t - 0.5) + 0.1 * np.sin(12 * s + phase), 0, 1)
    rgba = np.stack([red, green, blue, alpha], -1)
    return np.rint(255 * rgba).astype(np.uint8)


def cap_textures(layers: int, frame: int, resolution: int) -> NDArray[np.uint8]:
    """(N, R, R, 4), before cropping."""
    return np.stack([cap_texture(layer, frame, resolution) for layer in range(layers)])


def write_store(path: Path, frames: NDArray[np.uint8]) -> FrameStore:
    """Write (K, N, R, R, 4) as a layered texture store and open it."""

    def rows() -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
        for frame, layers in enumerate(frames):
            for layer, texture in enumerate(layers):
                yield layer, frame, texture

    resolution = frames.shape[2]
    write_frames(path, (resolution, resolution, 4), rows())
    return FrameStore(path)


@dataclass(frozen=True)
class Store:
    """Textures (K, N, R, R, 4)."""

    frames: NDArray[np.uint8]

    def image(self, layer: int, frame: int, /) -> NDArray[np.uint8]:
        return np.asarray(self.frames[frame, layer])


def cap_crops(layers: int, frames: int, resolution: int) -> tuple[CroppedLayer, ...]:
    """What the writer makes of the layers of `make_asset`."""
    textures = Store(np.stack([cap_textures(layers, frame, resolution) for frame in range(frames)]))
    meshes = [cap_mesh(radius_of(layer)) for layer in range(layers)]
    return crop_layers(meshes, [WINDOW] * layers, textures, frames)


def write_asset(
    folder: Path,
    meshes: Sequence[TexturedMesh],
    windows: Sequence[Window],
    textures: FrameStore,
    source: AssetSource,
    params: CompressParams,
) -> Manifest:
    """Write an asset of one level, as `package` does."""
    frames = check_textures(textures, len(meshes))
    layers = crop_layers(meshes, windows, textures, frames)
    with atomic_folder(folder) as temporary:
        content = LevelContent(layers, textures, frames, source.fps)
        level = write_level(temporary, FULL, content, params.mesh, params.video)
        return write_manifest(manifest_of(source, [level], temporary), temporary / MANIFEST_NAME)


def make_asset(
    folder: Path,
    layers: int = 3,
    frames: int = 5,
    resolution: int = 64,
    params: CompressParams | None = None,
    source: AssetSource = SOURCE,
) -> Asset:
    """Write the synthetic asset to `folder` (its textures' store goes beside it), and read it."""
    textures = np.stack([cap_textures(layers, frame, resolution) for frame in range(frames)])
    store = write_store(folder.parent / f"{folder.name}-textures.arrow", textures)
    meshes = [cap_mesh(radius_of(layer)) for layer in range(layers)]
    write_asset(folder, meshes, [WINDOW] * layers, store, source, params or PLAIN)
    return read_asset(folder)
