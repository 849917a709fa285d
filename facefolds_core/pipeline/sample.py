"""Sample the model: N grids of R x R surface points with normals, and their texture frames: data/<subject>/samples."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.config.stages import read_stage, read_train
from facefolds_core.errors import UserError
from facefolds_core.export.steps import SAMPLED_VIEWS, check_frames, sample_model
from facefolds_core.export.stores import write_grids
from facefolds_core.facts import shorten
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder, read_json
from facefolds_core.model import load_model
from facefolds_core.model.device import device_of
from facefolds_core.params import SampleParams


def _key_frames(fit: Path, scene: Scene) -> list[int] | None:
    """Of a take that was trained in segments; None of one that was trained at once.

    Raises:
        UserError: if one of them is not in the scene.
    """
    names = read_json(fit).get("key_frames") if fit.exists() else None
    if names is None:
        return None
    numbers = {name: k for k, name in enumerate(scene.frame_ids)}
    missing = [name for name in names if name not in numbers]
    if missing:
        raise UserError(
            "the model and the scene do not belong together",
            file=fit,
            place="key_frames",
            expected=f"frames of {scene.folder}",
            found=shorten(missing),
            remedy="run `dvc repro`, which trains again",
        )
    return [numbers[name] for name in names]


def sample(folders: SubjectFolders) -> str:
    params = read_stage(SampleParams, folders.config)
    model = load_model(folders.model, device_of(read_train(folders.config)))
    scene = read_scene(folders.scene)
    check_frames(model, scene, folders.model)
    with atomic_folder(folders.samples) as temporary:
        cameras = scene.views_of("train", SAMPLED_VIEWS)
        kept = folders.checkpoints / "sampled"
        keys = _key_frames(folders.model / "fit.json", scene) if params.opacity == "key_frames" else None
        grids = sample_model(model, cameras, params, temporary, kept, keys)
        write_grids(temporary / "grids.npz", grids)
    u0, u1, v0, v1 = grids.windows[0]
    return (
        f"{grids.num_layers} layers of {grids.resolution} x {grids.resolution} samples ({grids.valid.mean():.1%} "
        f"valid) over u {u0:.2f}..{u1:.2f}, v {v0:.2f}..{v1:.2f}, {model.num_frames} texture frames, "
        f"in {folders.samples}"
    )
