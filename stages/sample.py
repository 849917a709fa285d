"""Sample the model: N grids of R x R surface points with normals, and their texture frames: data/<subject>/samples."""

from __future__ import annotations

from dataclasses import replace

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.config import read_stage, read_train
from facefolds_core.errors import UserError
from facefolds_core.export.sampling import sample_grids, write_textures
from facefolds_core.export.stores import write_grids
from facefolds_core.export.window import visible_window
from facefolds_core.files import atomic_folder
from facefolds_core.geometry.sphere_uv import FULL_WINDOW
from facefolds_core.model import RadianceManifolds, load_model
from facefolds_core.model.device import pick_device
from facefolds_core.params import SampleParams
from facefolds_core.paths import SubjectFolders
from stages.common import run_stage


def sample(folders: SubjectFolders) -> str:
    params = read_stage(SampleParams, folders.config)
    model = load_model(folders.model, pick_device(read_train(folders.config).device))
    scene = read_scene(folders.scene)
    check_match(model, scene, folders)
    window = FULL_WINDOW
    if params.window == "auto":
        cameras = [scene.cameras[i] for i in scene.indices("train")]
        window = visible_window(model, cameras, params.auto_window)
    grids = sample_grids(model, params.resolution, window)
    with atomic_folder(folders.samples) as temporary:
        opacity = write_textures(temporary / "textures.arrow", model, grids)
        write_grids(temporary / "grids.npz", replace(grids, opacity=opacity))
    u0, u1, v0, v1 = window
    return (
        f"{grids.num_layers} layers of {params.resolution} x {params.resolution} samples ({grids.valid.mean():.1%} "
        f"valid) over u {u0:.2f}..{u1:.2f}, v {v0:.2f}..{v1:.2f}, {model.num_frames} texture frames, "
        f"in {folders.samples}"
    )


def check_match(model: RadianceManifolds, scene: Scene, folders: SubjectFolders) -> None:
    """Raises UserError if the model was trained on another number of frames."""
    if model.num_frames != scene.num_frames:
        raise UserError(
            "the model and the scene do not belong together",
            file=folders.model,
            expected=f"{scene.num_frames} frames, as in {folders.scene}",
            found=f"{model.num_frames} frames",
            remedy="run `dvc repro`, which trains again",
        )


if __name__ == "__main__":
    run_stage("sample", sample, __doc__ or "")
