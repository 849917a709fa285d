"""The asset that ships (Draco meshes, texture video, manifest), and one frame of it as GLB."""

from __future__ import annotations

import sys

from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.writer import AssetSource
from facefolds_core.captures.scene import read_scene
from facefolds_core.config import read_stage
from facefolds_core.export.collapse import decimated_ladder
from facefolds_core.export.decimation import decimate_layers
from facefolds_core.export.stores import (
    holds_sheets,
    read_centre,
    read_grids,
    read_meshes,
    read_sheets,
    read_surfaces,
    read_windows,
)
from facefolds_core.frame_store import FrameStore
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.packaging.notes import codec_warning
from facefolds_core.packaging.package import Export, package
from facefolds_core.params import CompressParams, DecimateParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def compress(folders: SubjectFolders) -> str:
    params = read_stage(CompressParams, folders.config)
    scene = read_scene(folders.scene)
    meshes = read_meshes(folders.meshes / "meshes.npz")
    windows = read_windows(folders.samples / "grids.npz")
    textures = FrameStore(folders.textures / "textures.arrow")
    centre = read_centre(folders.samples / "grids.npz")
    source = AssetSource(scene.subject, scene.fps, scene.from_capture.inverse(), centre)

    path, ladder = folders.surfaces / "surfaces.npz", {}
    if params.levels and holds_sheets(path):
        counts = [level.mesh_resolution**2 for level in params.levels]
        ladder = decimated_ladder(read_sheets(path), counts, read_stage(DecimateParams, folders.config))

    def decimate(resolution: int) -> list[TexturedMesh]:
        if ladder:
            return ladder[resolution**2]
        grids = read_grids(folders.samples / "grids.npz")
        section = read_stage(DecimateParams, folders.config).model_copy(update={"resolution": resolution})
        return decimate_layers(read_surfaces(path), grids, grids.centre, section)

    manifest = package(folders.asset, Export(meshes, windows, textures, decimate), scene, source, params)
    level = manifest.full
    glb_frame = params.glb.frame * (level.texture.frames // scene.num_frames)
    write_glb(folders.glb, read_level(folders.asset, level), scene.subject, glb_frame, params.glb.draco)
    mesh_bytes = sum(layer.bytes for layer in level.layers)
    videos = ", ".join(f"{video.codec} level {video.level}, {video.bytes} bytes" for video in level.texture.videos)
    quality = f", {level.quality.psnr_to_model:.1f} dB to what went in" if level.quality else ""
    warning = codec_warning(level.quality.psnr_to_model if level.quality else None, params.video, params.search.noticed)
    if warning:
        sys.stderr.write(f"compress: {warning}\n")
    coarser = "".join(f"; {other.name} {other.bytes} bytes" for other in manifest.levels[:-1])
    return (
        f"{len(level.layers)} of {len(meshes)} meshes ({mesh_bytes} bytes) and {level.texture.frames} frames "
        f"in {level.texture.width} x {level.texture.height} ({videos}){quality}{coarser}; {folders.asset}"
    )


if __name__ == "__main__":
    run_stage("compress", compress, __doc__ or "")
