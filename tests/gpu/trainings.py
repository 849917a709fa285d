"""`python -m tests.gpu.trainings FOLDER`: a tiny scene trained on the CPU and on a GPU, or in the simulator of one.

Writes FOLDER/cpu.npz and FOLDER/cuda.npz: the models, with the PSNR of their training rays."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams, train_params
from facefolds_core.training.explicit.loop import fit_explicit
from tests.scenes import make_scene

TINY = {
    "preset": "fast",
    "layers": 3,
    "iterations": 8,
    "geometry": {"rounds": [1.0, 0.5], "round_iterations": 2},
    "reflection": {"enabled": False},
    "textures": {"rays_per_texel": 0.3, "steps_per_frame": 1, "full_rate_iterations": 6},
}


def model(scene: Scene, device: str, log: Path) -> dict[str, np.ndarray]:
    params = train_params({**TINY, "device": device})
    assert isinstance(params, ExplicitParams)
    trained = fit_explicit(scene, params, log)
    values = {name: value.detach().numpy() for name, value in trained.model.state_dict().items()}
    return {**values, "psnr": np.array(trained.report.final_psnr)}


def main(folder: Path) -> None:
    scene = make_scene(folder / "scene", cameras=5, size=20, mattes=True)
    for device in ("cpu", "cuda"):
        np.savez(folder / f"{device}.npz", **model(scene, device, folder / f"log_{device}"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
