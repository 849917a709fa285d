"""What each step of the export loses: from the model to the files that ship.

It is measured on the cameras for validation, and on the held-out ones where there are none.

Every step is rendered from what its stage left in data/<subject>, so the steps are those of the asset that is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.scene import Scene
from facefolds_core.export.decimation import exact_st
from facefolds_core.export.sheets import full_meshes
from facefolds_core.export.stores import holds_sheets, read_grids, read_meshes, read_sheets, read_surfaces
from facefolds_core.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window, uv_to_st
from facefolds_core.model import RadianceManifolds
from facefolds_core.paths import SubjectFolders
from facefolds_core.progress import progress
from facefolds_core.rendering import Hits, composite
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.scoring.evaluation import frame_rate_factor
from facefolds_core.scoring.metrics import Array, psnr, shown
from facefolds_core.scoring.model_view import ModelView

STEPS = ("model", "sampled", "meshed", "decimated", "resampled", "baked", "shipped")
"""The model without its view branch; its sampled textures on its exact surfaces; on the reconstructed surfaces; on the
decimated meshes; textures resampled to R^t; textures fitted to the meshes; Draco and video."""

Frame = Callable[[int], Sequence[NDArray[np.uint8]]]


@dataclass(frozen=True)
class Step:
    """One step, mean over all held-out images.

    Attributes:
        name: of STEPS.
        psnr: against the photos, dB, over the subject where the capture has masks.
        psnr_to_model: against the step `model`, dB, over the same pixels; None for that step.
        triangles: of all layers; 0 where there are none.
        mesh_bytes, texture_bytes: of the files that ship; before, of the bare arrays (positions, texture coordinates,
            indices; 8-bit RGBA of all frames).
    """

    name: str
    psnr: float
    psnr_to_model: float | None
    triangles: int
    mesh_bytes: int
    texture_bytes: int


@dataclass(frozen=True)
class _Source:
    """What a step renders: `hits` of a camera, and textures of a frame."""

    name: str
    hits: Callable[[Camera], Hits]
    frame: Frame
    triangles: int
    mesh_bytes: int
    texture_bytes: int


def waterfall(scene: Scene, model: RadianceManifolds, folders: SubjectFolders, frames: Sequence[int]) -> list[Step]:
    """All steps of `STEPS`, in order.

    Args:
        folders: of the subject, with all export stages run.
        frames: indices of the frames that are rendered, where the camera has a photo.

    Raises:
        UserError: if there is no photo to compare with.
    """
    sources = list(_sources(scene, model, folders))
    truths, masks = scene.open_frames(), scene.open_masks()
    to_truth: dict[str, list[float]] = {name: [] for name in STEPS}
    to_model: dict[str, list[float]] = {name: [] for name in STEPS}
    cameras = scene.indices(scene.choice_split)
    with progress(total=len(cameras) * len(frames), desc="waterfall", unit="image") as bar:
        for index in cameras:
            for k in frames:
                if k == frames[0] or scene.poses is not None:
                    camera = scene.camera_in_head(index, k)
                    view = ModelView(model, camera)
                    hits = [source.hits(camera) for source in sources]
                truth = truths.image(index, k) / 255.0
                has_mask = masks is not None and (index, k) in masks
                mask = masks.image(index, k)[..., 0] / 255.0 if masks is not None and has_mask else None
                reference = shown(view.render(float(k))[1])
                _add(to_truth["model"], reference, truth, mask)
                for source, found in zip(sources, hits, strict=True):
                    picture = shown(composite(found, source.frame(k))[0])
                    _add(to_truth[source.name], picture, truth, mask)
                    _add(to_model[source.name], picture, reference, mask)
                bar.update()
    steps = [Step("model", float(np.mean(to_truth["model"])), None, 0, 0, 0)]
    for source in sources:
        truth_db, model_db = (float(np.mean(values[source.name])) for values in (to_truth, to_model))
        sizes = (source.triangles, source.mesh_bytes, source.texture_bytes)
        steps.append(Step(source.name, truth_db, model_db, *sizes))
    return steps


def _add(values: list[float], image: Array, truth: Array, mask: Array | None) -> None:
    value = psnr(image, truth, mask)
    if value is not None:
        values.append(value)


def _sources(scene: Scene, model: RadianceManifolds, folders: SubjectFolders) -> Iterator[_Source]:
    grids = read_grids(folders.samples / "grids.npz")
    surfaces, window = folders.surfaces / "surfaces.npz", grids.window(0)
    if holds_sheets(surfaces):
        fine = full_meshes(read_sheets(surfaces))
    else:
        fine = [
            TexturedMesh(s.vertices, s.faces, exact_st(s.vertices, window, grids.chart))
            for s in read_surfaces(surfaces)
        ]
    coarse = read_meshes(folders.meshes / "meshes.npz")
    stores = [
        FrameStore(folder / "textures.arrow") for folder in (folders.samples, folders.resampled, folders.textures)
    ]
    exact = _Source("sampled", lambda camera: exact_hits(model, camera, window), _frame(stores[0]), 0, 0, 0)
    yield exact
    for name, meshes, store in (
        ("meshed", fine, stores[0]),
        ("decimated", coarse, stores[0]),
        ("resampled", coarse, stores[1]),
        ("baked", coarse, stores[2]),
    ):
        yield _of_meshes(name, meshes, store)
    yield _of_asset(read_asset(folders.asset), scene)


def _of_meshes(name: str, meshes: Sequence[TexturedMesh], store: FrameStore) -> _Source:
    sizes = sum(mesh.vertices.nbytes + mesh.faces.nbytes + mesh.st.nbytes for mesh in meshes)
    texels = len(store.keys()) * store.height * store.width * store.channels
    triangles = sum(len(mesh.faces) for mesh in meshes)
    return _Source(name, lambda camera: cast_layers(camera, meshes), _frame(store), triangles, sizes, texels)


def _of_asset(asset: Asset, scene: Scene) -> _Source:
    step = frame_rate_factor(scene, asset)
    level = asset.manifest.full
    files = sum(layer.bytes for layer in level.layers)
    triangles = sum(layer.triangles for layer in level.layers)
    return _Source(
        "shipped",
        lambda camera: cast_layers(camera, asset.layers),
        lambda k: asset.frame(k * step),
        triangles,
        files,
        level.texture.videos[0].bytes,
    )


def _frame(store: FrameStore) -> Frame:
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
