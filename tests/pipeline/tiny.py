"""The project in a temporary folder, with a tiny actor, to run the real pipeline on."""

from __future__ import annotations

import io
import runpy
import shutil
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

from facefolds_core.system.processes import own_environment

PARAMS = """\
subjects:
  actor:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    train: {preset: fast, iterations: 60, layers: 3, geometry: {nodes: 48, round_iterations: 20},
            reflection: {texels: 6, environment_texels: 4}}
  stabilised:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    normalize: {stabilize: true}
    train: {iterations: 150, checkpoint_seconds: 0.2, rays: 512, layers: 3, texture_width: 32, manifold_width: 32}
capture: {cameras: 8, frames: 2, height: 48, width: 32, mattes: true, plates: false}
subject: {iterations: 150}
train: {preset: quick}
sample: {resolution: 64}
reconstruct: {}
decimate: {resolution: 12}
texture: {resolution: 32}
bake: {}
normalize: {}
compress:
  video: {preset: veryfast, target_psnr: null}
  levels: [{name: small, mesh_resolution: 8, texture_resolution: 32, crf: 30}]
evaluate: {}
"""


class TinyProject:
    """The project's code beside parameters of its own.

    The code is a link: numba keeps compiled kernels beside their source, and a copy would compile them all anew.

    Attributes:
        root: its folder.
    """

    def __init__(self, source: Path, root: Path, params: str = PARAMS, own_code: bool = False) -> None:
        """Make the project in `root`; with `own_code` the code is a copy, for tests that change or commit it."""
        self.root = root
        root.mkdir(parents=True, exist_ok=True)
        for name in ("stages", "facefolds_core"):
            if own_code:
                shutil.copytree(source / name, root / name, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
            else:
                (root / name).symlink_to(source / name)
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
        return own_environment(PYTHONPATH=str(self.root), DVC_NO_ANALYTICS="1")

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
        output, _ = process.communicate(timeout=900)
        return process.returncode, output

    def done(self, *command: str) -> str:
        """Output of a command that must succeed."""
        status, output = self.run(*command)
        assert status == 0, output
        return output

    def repro(self, *targets: str) -> tuple[int, str]:
        return self.run("dvc", "repro", *targets)

    def stage_here(self, name: str, subject: str = "actor") -> tuple[int, str]:
        """A stage in this process, which has imported what stages import (seconds): exit status and output."""
        said = io.StringIO()
        before = sys.argv
        with chdir(self.root), redirect_stdout(said), redirect_stderr(said):
            sys.argv = [name, "--subject", subject]
            try:
                runpy.run_path(str(self.root / "stages" / f"{name}.py"), run_name="__main__")
            except SystemExit as end:
                return int(end.code or 0), said.getvalue()
            finally:
                sys.argv = before
        return 0, said.getvalue()
