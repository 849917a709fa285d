"""Texture frames that ship, held where a change would not show: data/<subject>/textures."""

from __future__ import annotations

from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_stage
from facefolds_core.export import steps
from facefolds_core.export.stores import read_grids, read_meshes
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import BakeParams


def bake(folders: SubjectFolders) -> str:
    grids = read_grids(folders.samples / "grids.npz")
    scene = read_scene(folders.scene).with_torso(grids.torso)
    with atomic_folder(folders.textures) as temporary:
        rays = steps.bake(
            scene.views_of("train", steps.BAKED_VIEWS),
            grids,
            read_meshes(folders.meshes / "meshes.npz"),
            folders.resampled / steps.TEXTURES,
            read_stage(BakeParams, folders.config),
            temporary,
            folders.checkpoints / "held",
        )
    if rays == 0:
        return f"textures as they were resampled, in {folders.textures}"
    return f"texels held by what shows along {rays} rays, in {folders.textures}"
