"""Sample the model: N grids of R x R surface points with normals, and their texture frames: data/<subject>/samples."""

from __future__ import annotations

from dataclasses import replace

from facefolds_core.captures.scene import check_frames, read_scene
from facefolds_core.config.stages import read_stage, read_train
from facefolds_core.export.sampling import sample_grids, samples_for, write_textures
from facefolds_core.export.stores import TEXTURES, write_grids
from facefolds_core.export.window import visible_window
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.model import load_model
from facefolds_core.model.device import device_of
from facefolds_core.params import SampleParams

VIEWS = 3
"""Frames of each training camera that the window is looked for in, where the head turns."""


def sample(folders: SubjectFolders) -> str:
    params = read_stage(SampleParams, folders.config)
    model = load_model(folders.model, device_of(read_train(folders.config)))
    scene = read_scene(folders.scene).with_torso(model.torso)
    check_frames("model", model.num_frames, scene)
    with atomic_folder(folders.samples) as temporary:
        window = model.window if params.window != "auto" else visible_window(model, scene.views_of("train", VIEWS))
        r = samples_for(model, window) if params.resolution == "auto" else params.resolution
        grids = sample_grids(model, r, window)
        opacity = write_textures(temporary / TEXTURES, model, grids)
        grids = replace(grids, opacity=opacity, reflection=model.reflection_maps(), torso=model.torso)
        write_grids(temporary / "grids.npz", grids)
    u0, u1, v0, v1 = grids.windows[0]
    return (
        f"{grids.num_layers} layers of {grids.resolution} x {grids.resolution} samples ({grids.valid.mean():.1%} "
        f"valid) over u {u0:.2f}..{u1:.2f}, v {v0:.2f}..{v1:.2f}, {model.num_frames} texture frames, "
        f"in {folders.samples}"
    )
