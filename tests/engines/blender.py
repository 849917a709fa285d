"""Blender (bpy in an environment of its own, or the program), and what it shows of a GLB or of USD."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.geometry.cameras import Camera
from tests.scenes import view_of

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "engines" / "blender" / "render.py"
VARIABLE = "FACEFOLDS_BLENDER"
REMEDY = f"`make blender` makes an environment with bpy; {VARIABLE} names another Python with bpy, or Blender itself"


@cache
def find_blender() -> tuple[str, ...] | None:
    """How a script of Blender's is started: Python with bpy, or the program. None if there is neither."""
    places = [os.environ.get(VARIABLE), str(ROOT / ".venv-blender" / "bin" / "python"), shutil.which("blender")]
    for place in filter(None, places):
        program = shutil.which(place)
        if program is None:
            continue
        if Path(program).name.startswith("blender"):
            return program, "-b", "--factory-startup", "-P", str(SCRIPT), "--"
        if subprocess.run([program, "-c", "import bpy"], capture_output=True, timeout=120, check=False).returncode == 0:
            return program, str(SCRIPT)
    return None


def pictures(
    file: Path, cameras: Sequence[Camera], background: float, reflection: Path | None = None, frame: int = 0
) -> dict[str, NDArray[np.float64]]:
    """What Blender renders, a sample a pixel: by camera's name, (H, W, 3) in [0, 1]."""
    start = find_blender()
    assert start is not None
    with tempfile.TemporaryDirectory() as place:
        files = {camera.name: Path(place) / f"{camera.name}.png" for camera in cameras}
        views = [{"file": str(files[camera.name]), **view_of(camera)} for camera in cameras]
        (Path(place) / "views.json").write_text(json.dumps(views))
        words = ["--views", f"{place}/views.json", "--samples", "1", "--frame", str(frame)]
        words += ["--background", *[str(background)] * 3]
        words += ["--reflection", str(reflection)] if reflection else []
        done = subprocess.run([*start, str(file), *words], capture_output=True, text=True, timeout=240, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return {name: np.asarray(Image.open(file).convert("RGB")) / 255 for name, file in files.items()}
