"""`python -m tests.gpu.trainings FOLDER`: a tiny scene trained on the CPU and on a GPU, or in the simulator of one.

Writes FOLDER/cpu.npz and FOLDER/cuda.npz: a volume and a room of random values after some steps, and the model that is
trained from the CPU's volume, with the PSNR of its training rays. A volume that begins as even fog would not do: its
gradients cancel, what is left is rounding, and Adam takes a whole step by its sign. So a change of 1e-7 in a ray's
origin moves voxels on the CPU, too, and what is chosen from them (window, centre) differs."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams, train_params
from facefolds_core.training.adam import corrections
from facefolds_core.training.device import Device
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.volume import fit
from facefolds_core.training.volume.optimise import Rays
from facefolds_core.training.volume.room import room_type
from facefolds_core.training.volume.steps import steps_type
from tests.scenes import make_scene

TINY = {
    "preset": "fast",
    "layers": 3,
    "iterations": 8,
    "volume": {"rays": 60, "learning_rate": 1.0, "levels": [{"resolution": 8, "iterations": 6, "room": 8}]},
    "room": {"needed_below": 0},
    "geometry": {"rounds": [1.0, 0.5], "round_iterations": 2, "round_stride": 2},
    "reflection": {"enabled": False},
    "textures": {"rays_per_texel": 0.3, "steps_per_frame": 1, "full_rate_iterations": 6},
}


def rays(count: int, rng: np.random.Generator) -> Rays:
    """From half a unit away, through the middle."""
    origins = rng.normal(size=(count, 3)).astype(np.float32)
    origins *= 0.5 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.2, 0.2, (count, 3)).astype(np.float32) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    colours = rng.random((count, 3), np.float32)
    unknown = np.full((count, 3), np.nan, np.float32), np.full(count, -1, np.float32)
    return Rays(origins, directions, origins, directions, colours, np.zeros(count, np.int32), *unknown)


def volume(gpu: bool) -> dict[str, np.ndarray]:
    """Three steps of a volume, and of the room behind it."""
    params, rng, size = ExplicitParams(), np.random.default_rng(0), 8
    values = rng.random((size, size, size, 4), np.float32)
    room = room_type(gpu)(np.full(3, 0.5, np.float32), 1.0, 0.3, params.room, params.environment)
    room.refine(size)
    room.grid[0] = rng.random(room.grid[0].shape, np.float32)
    steps = steps_type(gpu)(values, np.ones((size,) * 3, np.float32), np.full(3, -0.28), 0.08, params.volume)
    for i in range(3):
        if i == 1:
            room.refine(size + 1)  # at home in between
        steps.occupy()
        seen, jitter = rays(40, rng), rng.random(40, np.float32)
        behind = room.look(seen.origins, seen.directions, jitter)
        _, residual, transmittance = steps.shade(seen, jitter, behind.colours)
        bias = corrections(params.volume.betas, i + 1)
        room.step(behind, transmittance[:, None] * residual, 1.0, 0.02, 0.01)
        steps.move(0.02, 0.01, *bias)
    room.forget_unseen(seen.origins, seen.directions, transmittance)
    return {"volume": steps.values(), "room": room.grid}


def model(scene: Scene, device: str, log: Path) -> dict[str, np.ndarray]:
    params = train_params({**TINY, "device": device})
    assert isinstance(params, ExplicitParams)
    chosen, fit.choose = fit.choose, lambda name: Device(False)
    try:
        trained = fit_explicit(scene, params, log)
    finally:
        fit.choose = chosen
    values = {name: value.detach().numpy() for name, value in trained.model.state_dict().items()}
    return {**values, "psnr": np.array(trained.report.final_psnr)}


def main(folder: Path) -> None:
    scene = make_scene(folder / "scene", cameras=5, size=20, mattes=True)
    for device in ("cpu", "cuda"):
        found = {**volume(device == "cuda"), **model(scene, device, folder / f"log_{device}")}
        np.savez(folder / f"{device}.npz", **found)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
