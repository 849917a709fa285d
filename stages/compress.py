"""The asset that ships: Draco meshes, texture video, manifest."""

from __future__ import annotations

from facefolds_core.asset import AssetSource, write_asset
from facefolds_core.captures.frames import FrameStore
from facefolds_core.captures.scene import SPHERE_CENTRE, read_scene
from facefolds_core.config import read_stage
from facefolds_core.export.stores import read_meshes, read_windows
from facefolds_core.params import CompressParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def compress(folders: SubjectFolders) -> str:
    params = read_stage(CompressParams, folders.config)
    scene = read_scene(folders.scene)
    meshes = read_meshes(folders.meshes / "meshes.npz")
    windows = read_windows(folders.samples / "grids.npz")
    textures = FrameStore(folders.textures / "textures.arrow")
    source = AssetSource(scene.subject, scene.fps, scene.from_capture.inverse(), SPHERE_CENTRE)
    manifest = write_asset(folders.asset, meshes, windows, textures, source, params)
    level = manifest.full
    mesh_bytes = sum(layer.bytes for layer in level.layers)
    video = level.texture.videos[0]
    return (
        f"{len(level.layers)} of {len(meshes)} meshes ({mesh_bytes} bytes) and {level.texture.frames} frames "
        f"in {level.texture.width} x {level.texture.height} {video.codec} level {video.level} ({video.bytes} bytes) "
        f"in {folders.asset}"
    )


if __name__ == "__main__":
    run_stage("compress", compress, __doc__ or "")
