"""Each surface with at most R^m x R^m vertices, and texture coordinates: data/<subject>/meshes."""

from __future__ import annotations

from facefolds_core.config import read_stage
from facefolds_core.export.collapse import decimate_sheets
from facefolds_core.export.decimation import decimate_layers, layer_order
from facefolds_core.export.stores import holds_sheets, read_grids, read_sheets, read_surfaces, write_meshes
from facefolds_core.files import atomic_folder
from facefolds_core.params import DecimateParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def decimate(folders: SubjectFolders) -> str:
    params = read_stage(DecimateParams, folders.config)
    path = folders.surfaces / "surfaces.npz"
    grids = read_grids(folders.samples / "grids.npz")
    if holds_sheets(path):
        meshes = decimate_sheets(read_sheets(path), params.resolution**2, params)
    else:
        meshes = decimate_layers(read_surfaces(path), grids, grids.centre, params)
    order = layer_order(meshes, grids.centre)
    with atomic_folder(folders.meshes) as temporary:
        write_meshes(temporary / "meshes.npz", meshes)
    vertices, triangles = sum(len(m.vertices) for m in meshes), sum(len(m.faces) for m in meshes)
    return (
        f"{len(meshes)} meshes, {vertices} vertices, {triangles} triangles; {order.crossed} of {order.compared} "
        f"vertices lie on the wrong side of a neighbouring layer, by {order.deepest:.1e} at most; in {folders.meshes}"
    )


if __name__ == "__main__":
    run_stage("decimate", decimate, __doc__ or "")
