"""Whether meshes, windows and textures can be an asset's, before any of it is written."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from facefolds_core.asset.checks import mesh_problems
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import Window


def check_inputs(meshes: Sequence[TexturedMesh], windows: Sequence[Window], textures: FrameStore) -> int:
    """The number K of frames of layers that can be an asset's.

    Raises:
        UserError: if they cannot, or do not belong together.
    """
    frames = check_textures(textures, len(meshes))
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


def check_textures(textures: FrameStore, layers: int | None = None) -> int:
    """The number K of frames of a store that holds N x K square RGBA textures.

    Raises:
        UserError: if it does not; where `layers` is None, of any number of them.
    """
    wrong = partial(UserError, file=textures.path, remedy="run `dvc repro` to make the textures again")
    if textures.channels != 4 or textures.height != textures.width:
        found = f"{textures.height} x {textures.width} x {textures.channels}"
        raise wrong("the textures are not square RGBA images", found=found)
    keys = textures.keys()
    frames = 1 + max((frame for _, frame in keys), default=-1)
    layers = 1 + keys[-1][0] if layers is None and keys else layers or 1
    if frames == 0 or keys != [(layer, frame) for layer in range(layers) for frame in range(frames)]:
        expected = f"{layers} layers x {frames} frames"
        raise wrong("the texture store is not complete", expected=expected, found=f"{len(keys)} images")
    return frames


def _check_mesh(mesh: TexturedMesh, place: str) -> None:
    if len(mesh.vertices) == 0 or len(mesh.faces) == 0:
        problems = ["no faces"]
    elif mesh.st.shape != (len(mesh.vertices), 2):
        problems = [f"texture coordinates {mesh.st.shape} for {len(mesh.vertices)} vertices"]
    else:
        problems = mesh_problems(mesh, len(mesh.vertices), len(mesh.faces))
    if problems:
        found = "; ".join(problems)
        raise UserError("a layer's mesh cannot be written", place=place, found=found, remedy="run `dvc repro` again")
