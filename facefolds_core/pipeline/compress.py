"""The asset that ships (Draco meshes, texture video, manifest), and one frame of it as GLB."""

from __future__ import annotations

import sys

from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.reader import read_level
from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_stage
from facefolds_core.errors import UserError
from facefolds_core.export.choosing import explained
from facefolds_core.export.stores import TEXTURES, read_meshes, read_places
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.packaging.notes import codec_warning
from facefolds_core.packaging.package import Export, package
from facefolds_core.packaging.settings import needed
from facefolds_core.params import CompressParams


def compress(folders: SubjectFolders) -> str:
    params = read_stage(CompressParams, folders.config)
    places, meshes = folders.samples / "grids.npz", read_meshes(folders.meshes / "meshes.npz")
    windows, chart, reflection, torso = read_places(places)
    if len(windows) != len(meshes):
        raise UserError(
            "meshes and samples do not belong together",
            file=places,
            expected=f"{len(meshes)} windows",
            found=len(windows),
            remedy="run `dvc repro`, which makes both again",
        )
    scene = read_scene(folders.scene).with_torso(torso)
    export = Export(
        meshes=meshes,
        windows=windows,
        textures=FrameStore(folders.textures / TEXTURES),
        centre=chart.centre,
        coarser={
            r: read_meshes(folders.meshes / f"level_{r}.npz")
            for r in {level.mesh_resolution for level in params.levels}
        },
        reflection=reflection,
    )
    if params.video.target_psnr is not None:
        shown = explained(scene, export.meshes, export.windows, export.reflection, export.textures)
        params = needed(params, shown)
    manifest = package(folders.asset, export, scene, params)
    level = manifest.full
    write_glb(folders.glb, read_level(folders.asset, level), scene.subject)
    mesh_bytes = sum(layer.bytes for layer in level.layers)
    videos = ", ".join(f"{video.codec} level {video.level}, {video.bytes} bytes" for video in level.texture.videos)
    quality = f", {level.quality.psnr_to_model:.1f} dB to what went in" if level.quality else ""
    warning = codec_warning(level.quality)
    if warning:
        sys.stderr.write(f"compress: {warning}\n")
    coarser = "".join(f"; {other.name} {other.bytes} bytes" for other in manifest.levels[:-1])
    return (
        f"{len(level.layers)} of {len(export.meshes)} meshes ({mesh_bytes} bytes) and {level.texture.frames} frames "
        f"in {level.texture.width} x {level.texture.height} ({videos}){quality}{coarser}; {folders.asset}"
    )
