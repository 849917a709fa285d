"""A take that is trained in segments within seconds."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams, train_params
from facefolds_core.training.segments.loop import train_take
from tests.scenes import make_scene

FRAMES = 5


def params(**segments: object) -> ExplicitParams:
    given = {
        "preset": "fast",
        "layers": 3,
        "iterations": 30,
        "geometry": {"rounds": [1.0], "round_iterations": 10},
        "reflection": {"enabled": False},
        "textures": {"steps_per_frame": 4},
        "segments": {"joint_frames": 0, "key_frames": 2, "frames": 2, "steps": 3, **segments},
    }
    found = train_params(given)
    assert isinstance(found, ExplicitParams)
    return found


def filmed(folder: Path) -> Scene:
    return make_scene(folder, size=32, frames=FRAMES, surface_radius=0.33, mattes=True)


def train(scene: Scene, folder: Path, **segments: object) -> Path:
    train_take(scene, params(**segments), folder / "model", folder / "checkpoints", folder / "log")
    return folder / "model"
