"""One triangle surface a layer from its samples, by screened Poisson reconstruction: data/<subject>/surfaces."""

from __future__ import annotations

from facefolds_core.config import read_stage
from facefolds_core.export.poisson import reconstruct_layers
from facefolds_core.export.stores import read_grids, write_surfaces
from facefolds_core.files import atomic_folder
from facefolds_core.params import ReconstructParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def reconstruct(folders: SubjectFolders) -> str:
    params = read_stage(ReconstructParams, folders.config)
    results = reconstruct_layers(read_grids(folders.samples / "grids.npz"), params)
    with atomic_folder(folders.surfaces) as temporary:
        write_surfaces(temporary / "surfaces.npz", [result.surface for result in results])
    errors = ", ".join(f"{result.error:.3f}" for result in results)
    triangles = sum(len(result.surface.faces) for result in results)
    return (
        f"{len(results)} surfaces of {triangles} triangles and "
        f"{', '.join(str(result.boundaries) for result in results)} boundary loops, "
        f"mean distance from the samples in sample spacings, outermost first: {errors}; in {folders.surfaces}"
    )


if __name__ == "__main__":
    run_stage("reconstruct", reconstruct, __doc__ or "")
