"""Texture frames fitted to the meshes that ship: data/<subject>/textures."""

from __future__ import annotations

import shutil

from facefolds_core.captures.frames import FrameStore, write_frames
from facefolds_core.captures.scene import read_scene
from facefolds_core.config import read_stage
from facefolds_core.errors import UserError
from facefolds_core.export.bake import Baker, baked_rows, gather_rays
from facefolds_core.export.hold import held_rows, texel_weights
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import Sheets, read_grids, read_meshes
from facefolds_core.files import atomic_folder
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.params import BakeParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def bake(folders: SubjectFolders) -> str:
    params = read_stage(BakeParams, folders.config)
    source = folders.resampled / "textures.arrow"
    if params.iterations == 0:
        with atomic_folder(folders.textures) as temporary:
            shutil.copyfile(source, temporary / "textures.arrow")
        return f"textures as they were resampled, in {folders.textures}"
    scene = read_scene(folders.scene)
    sheets = grid_sheets(read_grids(folders.samples / "grids.npz"), None).sheets
    meshes = read_meshes(folders.meshes / "meshes.npz")
    textures, samples = FrameStore(source), FrameStore(folders.samples / "textures.arrow")
    check_match(meshes, sheets, textures, samples, folders)
    rays = gather_rays([scene.cameras[i] for i in scene.indices("train")], meshes, sheets)
    baker = Baker(meshes, sheets, rays, textures.height)
    with atomic_folder(folders.textures) as temporary:
        shape = (textures.height, textures.width, 4)
        path = temporary / "textures.arrow"
        write_frames(path, shape, baked_rows(baker, textures, samples, params.iterations))
        if params.hold > 0 and scene.num_frames > 1:
            baked = FrameStore(path.rename(temporary / "baked.arrow"))
            weights = texel_weights(rays.shipped, baked, len(scene.indices("train")))
            write_frames(path, shape, held_rows(baked, weights, params.hold))
            baked.path.unlink()
    return f"{len(textures.keys())} textures fitted to {len(rays.shipped)} rays, in {folders.textures}"


def check_match(
    meshes: list[TexturedMesh], sheets: Sheets, textures: FrameStore, samples: FrameStore, folders: SubjectFolders
) -> None:
    """Raises UserError if meshes, samples and textures are not of the same layers and frames."""
    layers = {len(meshes), sheets.num_layers, 1 + max(layer for layer, _ in textures.keys())}  # noqa: SIM118
    if len(layers) > 1 or textures.keys() != samples.keys():
        raise UserError(
            "meshes, samples and textures do not belong together",
            file=folders.meshes,
            expected="as many layers and frames in each",
            found=f"{sorted(layers)} layers, {len(textures.keys())} textures of {len(samples.keys())} samples",
            remedy="run `dvc repro`, which makes them again",
        )


if __name__ == "__main__":
    run_stage("bake", bake, __doc__ or "")
