"""`python -m tests.gpu.trainings FOLDER`: a tiny scene trained on the CPU and on a GPU, or in the simulator of one.

Writes FOLDER/cpu.npz and FOLDER/cuda.npz: the model's parameters, and the PSNR of its training rays."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from facefolds_core.params import ExplicitParams, train_params
from facefolds_core.training.explicit.loop import fit_explicit
from tests.scenes import make_scene

TINY = {
    "preset": "fast",
    "layers": 3,
    "iterations": 8,
    "subject": {"larger": []},
    "room": {"max_thickness": 0.4},
    "volume": {"rays": 60, "learning_rate": 1.0, "levels": [{"resolution": 8, "iterations": 6, "room": 8}]},
    "geometry": {"rounds": [1.0, 0.5], "round_iterations": 2, "round_stride": 2},
    "reflection": {"enabled": False},
    "textures": {"rays_per_texel": 0.3, "steps_per_frame": 2},
}


def main(folder: Path) -> None:
    scene = make_scene(folder / "scene", cameras=5, size=20)
    for device in ("cpu", "cuda"):
        params = train_params({**TINY, "device": device})
        assert isinstance(params, ExplicitParams)
        trained = fit_explicit(scene, params, folder / f"log_{device}")
        values = {name: value.detach().numpy() for name, value in trained.model.state_dict().items()}
        np.savez(folder / f"{device}.npz", psnr=trained.report.final_psnr, **values)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
