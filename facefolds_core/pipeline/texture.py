"""Texture frames at R^t x R^t: data/<subject>/resampled."""

from __future__ import annotations

import sys

from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_stage
from facefolds_core.export.choosing import choose_texels
from facefolds_core.export.stores import TEXTURES, read_grids, read_meshes
from facefolds_core.export.textures import resample_store
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import TextureParams
from facefolds_core.pipeline.choices import write_choice


def texture(folders: SubjectFolders) -> str:
    params, samples = read_stage(TextureParams, folders.config), folders.samples / TEXTURES
    meshes, grids = read_meshes(folders.meshes / "meshes.npz"), read_grids(folders.samples / "grids.npz")
    scene, given = read_scene(folders.scene), params.resolution
    size, chosen = choose_texels(scene, meshes, grids, FrameStore(samples)) if given == "auto" else (given, None)
    with atomic_folder(folders.resampled) as temporary:
        source = resample_store(samples, temporary / TEXTURES, size)
        why = write_choice(temporary, chosen)
    if size > source.height:
        sys.stderr.write(
            f"texture: warning: texture.resolution {size} is above sample.resolution {source.height}; "
            "enlarging adds texels but no detail\n"
        )
    return (
        f"{len(source.keys())} textures, {source.height} x {source.width} to {size} x {size}, "
        f"in {folders.resampled}{why}"
    )
