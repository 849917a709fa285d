"""Texture frames fitted to the meshes that ship: data/<subject>/textures."""

from __future__ import annotations

import shutil
from pathlib import Path

from facefolds_core.captures.scene import read_scene
from facefolds_core.config import read_stage
from facefolds_core.errors import UserError
from facefolds_core.export.bake import Baker, Codes, baked_rows, gather_rays
from facefolds_core.export.hold import held_rows, texel_weights
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import Sheets, read_grids, read_meshes
from facefolds_core.files import atomic_folder
from facefolds_core.frame_store import FrameStore, write_frames
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
    with atomic_folder(folders.textures) as temporary:
        path = temporary / "textures.arrow"
        rays, cameras = _fit(folders, params, path)
        baked = FrameStore(path)
        count = len(baked.keys())
        if params.hold > 0 and any(frame > 0 for _, frame in baked):
            baked = FrameStore(path.rename(temporary / "baked.arrow"))
            weights = texel_weights(rays, baked, cameras, params.hold_frames)
            write_frames(path, (baked.height, baked.width, 4), held_rows(baked, weights, params.hold))
            baked.path.unlink()
    return f"{count} textures fitted to {len(rays)} rays, in {folders.textures}"


def _fit(folders: SubjectFolders, params: BakeParams, path: Path) -> tuple[Codes, int]:
    """Write the fitted textures; the rays on the meshes that ship, and of how many cameras they are.

    What it maps into memory, it lets go.
    """
    scene = read_scene(folders.scene)
    sheets = grid_sheets(read_grids(folders.samples / "grids.npz"), None).sheets
    meshes = read_meshes(folders.meshes / "meshes.npz")
    textures = FrameStore(folders.resampled / "textures.arrow")
    samples = FrameStore(folders.samples / "textures.arrow")
    check_match(meshes, sheets, textures, samples, folders)
    cameras = [scene.cameras[i] for i in scene.indices("train")]
    rays = gather_rays(cameras, meshes, sheets)
    baker = Baker(meshes, sheets, rays, textures.height, params.damping)
    shape = (textures.height, textures.width, 4)
    write_frames(path, shape, baked_rows(baker, textures, samples, params.iterations))
    return rays.shipped, len(cameras)


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
