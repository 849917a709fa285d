"""Train the model on the normalised scene: data/<subject>/model."""

from __future__ import annotations

from facefolds_core.captures.found_scene import found_scene
from facefolds_core.config.stages import read_train
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.training import trainers


def train(folders: SubjectFolders) -> str:
    params = read_train(folders.config)
    scene = found_scene(folders)
    report = trainers.train(scene, params, folders.model, folders.checkpoints, folders.training_log)
    return (
        f"{report.iterations} iterations on {report.device}, {report.rays_per_second:.0f} rays/s, "
        f"PSNR {report.final_psnr:.2f} dB on training rays, model in {folders.model}"
    )
