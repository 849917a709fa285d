"""Each surface with at most R^m x R^m vertices, and texture coordinates, for all levels: data/<subject>/meshes."""

from __future__ import annotations

from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_level_resolutions, read_stage
from facefolds_core.export import steps
from facefolds_core.export.stores import read_grids, read_surfaces, write_meshes
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import DecimateParams
from facefolds_core.pipeline.choices import write_choice


def decimate(folders: SubjectFolders) -> str:
    params = read_stage(DecimateParams, folders.config)
    surfaces = read_surfaces(folders.surfaces / "surfaces.npz")
    grids = read_grids(folders.samples / "grids.npz")
    levels = read_level_resolutions(folders.config)
    meshes, coarse, chosen = steps.decimate_all(
        surfaces, grids, read_scene(folders.scene), folders.samples / steps.TEXTURES, params, levels
    )
    with atomic_folder(folders.meshes) as temporary:
        write_meshes(temporary / "meshes.npz", meshes)
        for resolution, coarser in coarse.items():
            write_meshes(temporary / f"level_{resolution}.npz", coarser)
        why = write_choice(temporary, chosen)
    vertices, triangles = sum(len(m.vertices) for m in meshes), sum(len(m.faces) for m in meshes)
    others = "".join(f"; R^m {r}: {sum(len(m.faces) for m in found)} triangles" for r, found in coarse.items())
    return f"{len(meshes)} meshes, {vertices} vertices, {triangles} triangles{others}; in {folders.meshes}{why}"
