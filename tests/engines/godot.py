"""Godot 3 under a virtual screen, and what it shows of an exported folder."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.geometry.cameras import Camera

PROJECT = Path(__file__).parents[2] / "engines" / "godot"
NAMES = ("godot3", "godot3-runner")
TO_GODOT = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""(x, y, z) -> (y, z, x)."""
FLIP = np.diag([1.0, -1, -1])
"""A camera's own axes, OpenCV's -> OpenGL's."""


def missing() -> str | None:
    """What is not installed, in words; None if all is there."""
    lacking = [name for name in ("xvfb-run", "xauth") if shutil.which(name) is None]
    if find_godot() is None:
        lacking.append("godot3")
    return f"no {', '.join(lacking)}: apt-get install godot3 xvfb xauth" if lacking else None


def find_godot() -> str | None:
    return next(filter(None, map(shutil.which, NAMES)), None)


def view_of(camera: Camera, file: Path, frame: int) -> dict[str, Any]:
    """A camera whose axis goes through the picture's centre, as `tools/capture.gd` wants it."""
    rotation, translation = camera.w2c[:, :3], camera.w2c[:, 3]
    fov = math.degrees(2 * math.atan(camera.height / 2 / camera.K[1, 1]))
    return {
        "file": str(file),
        "frame": frame,
        "basis": (TO_GODOT @ rotation.T @ FLIP).tolist(),
        "origin": (TO_GODOT @ -(rotation.T @ translation)).tolist(),
        "fov": fov,
    }


def run_godot(job: dict[str, Any], driver: str = "GLES2") -> subprocess.CompletedProcess[str]:
    """Run `tools/capture.gd` with a job. Godot keeps its files in a home of its own.

    The code returned is Godot's own: xvfb-run's is 5 when its screen is slow to go, whatever Godot said.
    """
    with tempfile.TemporaryDirectory() as home:
        path = Path(home) / "job.json"
        path.write_text(json.dumps(job))
        for name in (".cache", ".config", ".local/share"):
            (Path(home) / name).mkdir(parents=True)
        environment = {**os.environ, "HOME": home, "LANG": "en_US.UTF-8", "FACEFOLDS_JOB": str(path)}
        for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "LC_ALL", "LC_MESSAGES"):
            environment.pop(name, None)
        godot = [str(find_godot()), "--path", str(PROJECT), "--audio-driver", "Dummy", "--video-driver", driver]
        screen = ["xvfb-run", "-a", "-s", "-screen 0 640x480x24"]
        status = Path(home) / "status"
        keep = ["sh", "-c", '"$@"; echo $? > "$0"', str(status)]
        command = [*screen, *keep, *godot, "--resolution", "64x64", "-s", "tools/capture.gd"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240, check=False)
        if status.exists():
            done.returncode = int(status.read_text())
        return done


def errors(done: subprocess.CompletedProcess[str]) -> list[str]:
    """What Godot complains of, but for a folder of its own that it cannot make in a bare home."""
    lines = [line for line in done.stderr.splitlines() if "ERROR" in line]
    return [line for line in lines if "make_dir_recursive" not in line]


def pictures(
    folder: Path, cameras: Sequence[Camera], frames: Sequence[int], background: float, driver: str = "GLES2"
) -> dict[tuple[str, int], NDArray[np.float64]]:
    """What Godot shows: by camera's name and frame, (H, W, 3) in [0, 1]."""
    with tempfile.TemporaryDirectory() as place:
        files = {(c.name, k): Path(place) / f"{c.name}_{k}.png" for k in frames for c in cameras}
        views = [view_of(camera, files[camera.name, frame], frame) for frame in frames for camera in cameras]
        size = {"width": cameras[0].width, "height": cameras[0].height}
        done = run_godot({"folder": str(folder), "background": [background] * 3, "views": views, **size}, driver)
        assert done.returncode == 0, done.stdout + done.stderr
        assert errors(done) == [], done.stderr
        return {key: np.asarray(Image.open(file).convert("RGB")) / 255 for key, file in files.items()}
