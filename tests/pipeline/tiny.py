"""A copy of the project in a temporary folder, with a tiny actor, to run the real pipeline on."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

PARAMS = """\
subjects:
  actor:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    train: {iterations: 60, rays: 512, layers: 3, texture_width: 32, manifold_width: 32}
  stabilised:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    normalize: {stabilize: true}
    train: {iterations: 10, rays: 512, layers: 3, texture_width: 32, manifold_width: 32}
  killed:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    train: {iterations: 400, checkpoint_seconds: 0.2, rays: 512, layers: 3, texture_width: 32, manifold_width: 32}
  fast:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    train: {preset: fast, layers: 3, iterations: 130}
capture: {cameras: 8, frames: 2, height: 48, width: 32}
train: {preset: quick}
sample: {resolution: 64}
reconstruct: {}
decimate: {resolution: 12}
texture: {resolution: 32}
bake: {}
normalize: {}
compress: {}
evaluate: {}
"""


class TinyProject:
    """The project's code beside parameters of its own.

    Attributes:
        root: its folder.
    """

    def __init__(self, source: Path, root: Path, params: str = PARAMS) -> None:
        self.root = root
        skip = shutil.ignore_patterns("__pycache__", "*.pyc")
        for name in ("stages", "facefolds_core"):
            shutil.copytree(source / name, root / name, ignore=skip)
        for name in ("dvc.yaml", ".dvcignore"):
            shutil.copy(source / name, root)
        (root / ".dvc").mkdir()
        (root / ".dvc" / "config").write_text("[core]\n    analytics = false\n    no_scm = true\n")
        self.write_params(params)

    def write_params(self, text: str) -> None:
        (self.root / "params.yaml").write_text(text)

    @property
    def params(self) -> str:
        return (self.root / "params.yaml").read_text()

    @property
    def environment(self) -> dict[str, str]:
        # The copy's code must win over the installed project.
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
        return {**os.environ, "PATH": path, "PYTHONPATH": str(self.root), "DVC_NO_ANALYTICS": "1"}

    def start(self, *command: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            command,
            cwd=self.root,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def run(self, *command: str) -> tuple[int, str]:
        """Exit status and output (both streams) of a command in the project's folder."""
        process = self.start(*command)
        output, _ = process.communicate(timeout=300)
        return process.returncode, output

    def repro(self, *targets: str) -> tuple[int, str]:
        return self.run("dvc", "repro", *targets)

    def stage(self, name: str, *arguments: str) -> tuple[int, str]:
        return self.run("python", "-m", f"stages.{name}", "--subject", "actor", *arguments)
