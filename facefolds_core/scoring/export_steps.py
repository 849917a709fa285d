"""What each step of the export has left in data/<subject>, as it is looked at: hits, textures, reflection, sizes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from facefolds_core.asset import Asset
from facefolds_core.export.decimation import exact_st
from facefolds_core.export.sheets import full_meshes
from facefolds_core.export.stores import Grids, holds_sheets, read_meshes, read_sheets, read_surfaces
from facefolds_core.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window, uv_to_st
from facefolds_core.model import RadianceManifolds
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering import Hits
from facefolds_core.rendering.areas import AreaView
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import Image
from facefolds_core.rendering.reflection import reflected_colours
from facefolds_core.scoring.posed import PosedView

Textures = Sequence[NDArray[np.uint8]]


@dataclass(frozen=True)
class Eye:
    """Where one looks from.

    Attributes:
        camera: in the head's own frame, by the scene's poses.
        to_room: (3, 3) rotation from there to the room, which reflected light is fixed to; None where the head stands.
        posed: the same camera's view of the model and of the asset.
    """

    camera: Camera
    to_room: NDArray[np.float64] | None
    posed: PosedView


@dataclass(frozen=True)
class Source:
    """A step.

    Attributes:
        name: of `waterfall.STEPS`.
        look: what an eye sees; one function for all steps that look the same.
        textures: of a frame of the scene, N layers (h, w, 4).
        triangles: of all layers; 0 where there are none.
        mesh_bytes, texture_bytes: as in `waterfall.Step`.
    """

    name: str
    look: Callable[[Eye], AreaView]
    textures: Callable[[int], Textures]
    triangles: int
    mesh_bytes: int
    texture_bytes: int


def steps_on_disk(grids: Grids, model: RadianceManifolds, folders: SubjectFolders) -> Iterator[Source]:
    """From `sampled` to `baked`. All have the reflection that `sample` took from the model, before it is coded.

    Args:
        grids: of `folders`.

    Raises:
        UserError: if a file is missing or damaged.
    """
    windows = [grids.window(i) for i in range(grids.num_layers)]
    stores = [FrameStore(one / "textures.arrow") for one in (folders.samples, folders.resampled, folders.textures)]

    def lit(cast: Callable[[Camera], Hits]) -> Callable[[Eye], AreaView]:
        def look(eye: Eye) -> AreaView:
            def hits(part: Camera) -> tuple[Hits, Sequence[Image] | None]:
                found, maps = cast(part), grids.reflection
                if maps is None:
                    return found, None
                return found, reflected_colours(found, part, windows, maps, eye.to_room)

            return AreaView.of_hits(eye.camera, hits)

        return look

    def of_meshes(meshes: Sequence[TexturedMesh], shown: Mapping[str, FrameStore]) -> Iterator[Source]:
        look, triangles = lit(lambda camera: cast_layers(camera, meshes)), sum(len(mesh.faces) for mesh in meshes)
        sizes = sum(mesh.vertices.nbytes + mesh.faces.nbytes + mesh.st.nbytes for mesh in meshes)
        for name, store in shown.items():
            texels = len(store.keys()) * store.height * store.width * store.channels
            yield Source(name, look, _textures(store), triangles, sizes, texels)

    yield Source("sampled", lit(lambda camera: exact_hits(model, camera, windows[0])), _textures(stores[0]), 0, 0, 0)
    yield from of_meshes(_reconstructed(grids, folders), {"meshed": stores[0]})
    coarse = read_meshes(folders.meshes / "meshes.npz")
    yield from of_meshes(coarse, dict(zip(("decimated", "resampled", "baked"), stores, strict=True)))


def shipped_step(asset: Asset, step: int) -> Source:
    """The files that ship, as `evaluate` looks at them: their own track and reflection.

    Args:
        step: frames of the asset a frame of the scene.
    """
    level = asset.manifest.full
    pictures = level.texture.videos[0].bytes + (level.reflection.bytes if level.reflection else 0)
    triangles, files = (sum(getattr(layer, what) for layer in level.layers) for what in ("triangles", "bytes"))
    return Source(
        "shipped",
        lambda eye: eye.posed.asset,
        lambda k: asset.frame(k * step),
        triangles,
        files,
        pictures,
    )


def _reconstructed(grids: Grids, folders: SubjectFolders) -> list[TexturedMesh]:
    """The surfaces before decimation."""
    path, window = folders.surfaces / "surfaces.npz", grids.window(0)
    if holds_sheets(path):
        return list(full_meshes(read_sheets(path)))
    surfaces = read_surfaces(path)
    return [TexturedMesh(s.vertices, s.faces, exact_st(s.vertices, window, grids.chart)) for s in surfaces]


def _textures(store: FrameStore) -> Callable[[int], Textures]:
    layers = sorted({layer for layer, _ in store})
    return lambda k: [store.image(layer, k) for layer in layers]


def exact_hits(model: RadianceManifolds, camera: Camera, window: Window) -> Hits:
    """Where a camera's rays meet the model's own surfaces, inside a window of the textures."""
    origins, directions = (torch.tensor(np.reshape(part, (-1, 3))).to(model.centre) for part in camera.rays())
    crossings = model.crossings(origins, directions)
    st = uv_to_st(model.chart.uv(crossings.points)[0], window).cpu().numpy()
    hit = crossings.hit.cpu().numpy() & (st >= 0).all(-1) & (st <= 1).all(-1)
    shape = (camera.height, camera.width, model.num_layers)
    return Hits(hit.reshape(shape), np.where(hit[..., None], st, 0).astype(np.float32).reshape(*shape, 2))
