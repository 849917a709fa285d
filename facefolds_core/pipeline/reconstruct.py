"""Triangle surfaces of the layers from their samples: data/<subject>/surfaces."""

from __future__ import annotations

from facefolds_core.config.stages import read_stage
from facefolds_core.export.poisson import reconstruct_layers
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import Grids, read_grids, write_meshes, write_sheets
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import ReconstructParams


def reconstruct(folders: SubjectFolders) -> str:
    params = read_stage(ReconstructParams, folders.config)
    grids = read_grids(folders.samples / "grids.npz")
    return {"grid": with_grid, "poisson": with_poisson}[params.method](grids, params, folders)


def with_grid(grids: Grids, params: ReconstructParams, folders: SubjectFolders) -> str:
    sheets = grid_sheets(grids, params.resolution)
    with atomic_folder(folders.surfaces) as temporary:
        write_sheets(temporary / "surfaces.npz", sheets)
    n = len(sheets.st)
    on = f"{sheets.valid.mean():.1%} of them on the surface"
    return f"{sheets.num_layers} sheets of {n} x {n} vertices, {on}; in {folders.surfaces}"


def with_poisson(grids: Grids, params: ReconstructParams, folders: SubjectFolders) -> str:
    surfaces = reconstruct_layers(grids, params)
    with atomic_folder(folders.surfaces) as temporary:
        write_meshes(temporary / "surfaces.npz", surfaces)
    triangles = sum(len(surface.faces) for surface in surfaces)
    return f"{len(surfaces)} surfaces of {triangles} triangles; in {folders.surfaces}"
