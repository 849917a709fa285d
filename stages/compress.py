"""The asset that ships: Draco meshes, texture video, manifest."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset import AssetSource, LayerMesh, write_asset
from facefolds_core.captures.frames import FrameStore
from facefolds_core.captures.scene import SPHERE_CENTRE, read_scene
from facefolds_core.config import read_stage
from facefolds_core.errors import UserError
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.params import CompressParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def compress(folders: SubjectFolders) -> str:
    params = read_stage(CompressParams, folders.config)
    scene = read_scene(folders.scene)
    source = AssetSource(scene.subject, scene.fps, scene.from_capture.inverse(), SPHERE_CENTRE)
    textures = FrameStore(folders.textures / "textures.arrow")
    manifest = write_asset(folders.asset, _meshes(folders), _windows(folders), textures, source, params)
    mesh_bytes = sum(layer.bytes for layer in manifest.layers)
    video = manifest.texture
    return (
        f"{len(manifest.layers)} meshes ({mesh_bytes} bytes) and {video.frames} frames "
        f"in {video.width} x {video.height} H.264 level {video.level} ({video.bytes} bytes) in {folders.asset}"
    )


def _meshes(folders: SubjectFolders) -> list[LayerMesh]:
    """The decimated meshes, outermost first."""
    path = folders.meshes / "meshes.npz"
    arrays = _read_arrays(path)
    layers = sum(name.startswith("vertices_") for name in arrays)
    names = [[f"{kind}_{layer:02d}" for kind in ("vertices", "faces", "st")] for layer in range(layers)]
    missing = [name for group in names for name in group if name not in arrays]
    if missing or layers == 0:
        raise _damaged(path, f"no array {', '.join(missing) or 'vertices_00'}")
    return [LayerMesh(arrays[v], arrays[f], arrays[st]) for v, f, st in names]


def _windows(folders: SubjectFolders) -> list[Window]:
    """(u0, u1, v0, v1) of each layer's texture."""
    path = folders.samples / "grids.npz"
    arrays = _read_arrays(path, {"windows"})
    if "windows" not in arrays or arrays["windows"].ndim != 2 or arrays["windows"].shape[1] != 4:
        raise _damaged(path, "no array windows of shape (N, 4)")
    return [(float(u0), float(u1), float(v0), float(v1)) for u0, u1, v0, v1 in arrays["windows"]]


def _read_arrays(path: Path, names: set[str] | None = None) -> dict[str, NDArray[Any]]:
    """Arrays of an .npz file by name; all, or those of `names` that are there."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files if names is None or name in names}
    except FileNotFoundError:
        raise UserError("file not found", file=path, remedy="run `dvc repro` to make it") from None
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise _damaged(path, str(error)) from None


def _damaged(path: Path, found: str) -> UserError:
    return UserError("damaged file", file=path, found=found, remedy="delete it and run `dvc repro` to make it again")


if __name__ == "__main__":
    run_stage("compress", compress, __doc__ or "")
