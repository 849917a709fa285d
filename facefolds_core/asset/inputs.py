"""Whether meshes, windows and textures can be an asset's, before any of it is written."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window


def check_inputs(meshes: Sequence[TexturedMesh], windows: Sequence[Window], textures: FrameStore) -> int:
    """The number K of frames of layers that can be an asset's.

    Raises:
        UserError: if they cannot, or do not belong together.
    """
    frames = _check_textures(textures, len(meshes))
    if len(windows) != len(meshes):
        raise UserError(
            "the meshes and the texture windows do not belong together",
            expected=f"{len(meshes)} windows",
            found=len(windows),
            remedy="run `dvc repro` to make both again",
        )
    for index, mesh in enumerate(meshes):
        _check_mesh(mesh, f"layer {index}")
    return frames


def _check_textures(textures: FrameStore, layers: int) -> int:
    """The number K of frames of a store that holds N x K square RGBA textures."""
    remedy = "run `dvc repro` to make the textures again"
    if textures.channels != 4 or textures.height != textures.width:
        raise UserError(
            "the textures are not square RGBA images",
            file=textures.path,
            found=f"{textures.height} x {textures.width} x {textures.channels}",
            remedy=remedy,
        )
    keys = textures.keys()
    frames = 1 + max((frame for _, frame in keys), default=-1)
    if frames == 0 or keys != [(layer, frame) for layer in range(layers) for frame in range(frames)]:
        raise UserError(
            "the texture store is not complete",
            file=textures.path,
            expected=f"{layers} layers x {frames} frames",
            found=f"{len(keys)} images",
            remedy=remedy,
        )
    return frames


def _check_mesh(mesh: TexturedMesh, place: str) -> None:
    problem = None
    if len(mesh.vertices) == 0 or len(mesh.faces) == 0:
        problem = "no faces"
    elif mesh.st.shape != (len(mesh.vertices), 2):
        problem = f"texture coordinates {mesh.st.shape} for {len(mesh.vertices)} vertices"
    elif not (np.isfinite(mesh.vertices).all() and np.isfinite(mesh.st).all()):
        problem = "numbers that are not finite"
    elif mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        problem = "faces that name vertices which are not there"
    elif mesh.st.min() < 0 or mesh.st.max() > 1:
        problem = f"texture coordinates from {mesh.st.min():g} to {mesh.st.max():g}, outside [0, 1]"
    if problem:
        raise UserError("a layer's mesh cannot be written", place=place, found=problem, remedy="run `dvc repro` again")
