"""Texture frames that ship, held where a change would not show: data/<subject>/textures."""

from __future__ import annotations

import shutil

from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_stage
from facefolds_core.errors import UserError
from facefolds_core.export.hold import held_rows, shown_rays, texel_weights
from facefolds_core.export.kept import KeptFrames
from facefolds_core.export.stores import TEXTURES, read_grids, read_meshes
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import BakeParams

VIEWS = 2
"""Poses in which each training camera sees what shows, where the head turns."""


def bake(folders: SubjectFolders) -> str:
    hold = read_stage(BakeParams, folders.config).hold
    grids, meshes = read_grids(folders.samples / "grids.npz"), read_meshes(folders.meshes / "meshes.npz")
    cameras = read_scene(folders.scene).with_torso(grids.torso).views_of("train", VIEWS)
    store = FrameStore(folders.resampled / TEXTURES)
    layers = {len(meshes), grids.num_layers, 1 + max(layer for layer, _ in store)}
    if len(layers) > 1:
        raise UserError(
            "meshes, samples and textures do not belong together",
            file=store.path,
            expected="as many layers in each",
            found=sorted(layers),
            remedy="run `dvc repro`, which makes them again",
        )
    with atomic_folder(folders.textures) as temporary:
        path = temporary / TEXTURES
        if hold == 0 or not any(frame > 0 for _, frame in store):
            shutil.copyfile(store.path, path)
            return f"textures as they were resampled, in {folders.textures}"
        rays = shown_rays(cameras, meshes, grids.opacity)
        earlier = KeptFrames(folders.checkpoints / "held")
        rows = held_rows(store, texel_weights(rays, store, len(cameras)), hold, temporary, earlier)
        write_frames(path, (store.height, store.width, 4), rows, packed=True)
        earlier.keep(path)
    return f"texels held by what shows along {len(rays)} rays, in {folders.textures}"
