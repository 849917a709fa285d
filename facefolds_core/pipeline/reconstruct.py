"""Triangle surfaces of the layers from their samples: data/<subject>/surfaces."""

from __future__ import annotations

from facefolds_core.config.stages import read_stage
from facefolds_core.export.poisson import reconstruct_layers
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import Grids, read_grids, write_sheets, write_surfaces
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import ReconstructParams


def reconstruct(folders: SubjectFolders) -> str:
    params = read_stage(ReconstructParams, folders.config)
    grids = read_grids(folders.samples / "grids.npz")
    return {"grid": with_grid, "poisson": with_poisson}[params.method](grids, params, folders)


def with_grid(grids: Grids, params: ReconstructParams, folders: SubjectFolders) -> str:
    made = grid_sheets(grids, params.resolution)
    with atomic_folder(folders.surfaces) as temporary:
        write_sheets(temporary / "surfaces.npz", made.sheets)
    n = len(made.sheets.st)
    return (
        f"{made.sheets.num_layers} sheets of {n} x {n} vertices, {made.sheets.valid.mean():.1%} of them on the "
        f"surface; {made.crossed} lay beyond the layer outside, by {made.deepest:.1e} at most, and were moved onto it; "
        f"in {folders.surfaces}"
    )


def with_poisson(grids: Grids, params: ReconstructParams, folders: SubjectFolders) -> str:
    results = reconstruct_layers(grids, params)
    with atomic_folder(folders.surfaces) as temporary:
        write_surfaces(temporary / "surfaces.npz", [result.surface for result in results])
    errors = ", ".join(f"{result.error:.3f}" for result in results)
    triangles = sum(len(result.surface.faces) for result in results)
    return (
        f"{len(results)} surfaces of {triangles} triangles and "
        f"{', '.join(str(result.boundaries) for result in results)} boundary loops, "
        f"mean distance from the samples in sample spacings, outermost first: {errors}; in {folders.surfaces}"
    )
