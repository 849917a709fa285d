"""A grid of experiments with DVC itself, on the real dvc.yaml and `configure`, with stand-ins for the other stages."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from pathlib import Path

import pytest

from bench.experiments import runs_of
from facefolds_core.cluster.table import Run
from facefolds_core.system.processes import own_environment
from tests.pipeline.test_dvc_yaml import STAGES

COMPUTING = STAGES[1:]
STUB = Path(__file__).with_name("stub_stage.py")


class GridProject:
    """A git checkout with the project's pipeline, whose stages are stubs.

    Attributes:
        root: its folder.
    """

    def __init__(self, source: Path, root: Path) -> None:
        self.root, self.ran = root, root.parent / "ran.txt"
        skip = shutil.ignore_patterns("__pycache__", "tmp", "cache", "config.local")
        for name in ("facefolds_core", ".dvc"):
            shutil.copytree(source / name, root / name, ignore=skip)
        for name in ("dvc.yaml", "params.yaml", ".gitignore", ".dvcignore"):
            shutil.copy(source / name, root)
        (root / "stages").mkdir()
        for name in ("__init__", "common", "configure"):
            shutil.copy(source / "stages" / f"{name}.py", root / "stages")
        for name in COMPUTING:
            shutil.copy(STUB, root / "stages" / f"{name}.py")
        self.run("git", "init", "--quiet")
        self.run("git", "add", "--all")
        self.run("git", "-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "--quiet", "--message", "start")

    def run(self, *command: str) -> str:
        variables = own_environment(RAN=str(self.ran), DVC_NO_ANALYTICS="1")
        variables.pop("PYTHONPATH", None)  # an experiment's own copy of the project must be the one that runs
        # Not a pipe: a queue's workers may hold on to it after their command's end.
        with tempfile.TemporaryFile("w+") as printed:
            done = subprocess.run(command, cwd=self.root, env=variables, stdout=printed, stderr=printed, timeout=900)
            printed.seek(0)
            text = printed.read()
        assert done.returncode == 0, text
        return text

    def stages_run(self) -> Counter[str]:
        """How often each stub ran since this was last asked."""
        lines = self.ran.read_text().split() if self.ran.exists() else []
        self.ran.write_text("")
        return Counter(lines)


@pytest.fixture(scope="module")
def project(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> GridProject:
    """One that was run."""
    project = GridProject(project_root, tmp_path_factory.mktemp("grid") / "project")
    project.run("dvc", "repro", "evaluate@actor")
    assert project.stages_run() == Counter(COMPUTING)
    return project


def test_a_texture_resolution_reruns_what_follows_and_is_kept(project: GridProject) -> None:
    """For all subjects or for one: DVC's cache has it either way."""
    path = project.root / "params.yaml"
    before = path.read_text()
    place = "    path: facefolds_core/captures/actor\n"
    for old, new, ran in (
        ("auto # R^t", "48 # R^t", ["texture", "bake", "compress", "evaluate"]),
        (place, f"{place}    texture: {{resolution: 48}}\n", []),
    ):
        assert before.count(old) == 1
        path.write_text(before.replace(old, new))
        project.run("dvc", "repro", "evaluate@actor")
        assert project.stages_run() == Counter(ran)
    path.write_text(before)


@pytest.fixture(scope="module")
def grid(project: GridProject) -> tuple[list[Run], Counter[str]]:
    """Rows of a grid of two texture resolutions, one of which fails, and which stages it ran."""
    values = "texture.resolution=13,128"
    project.run("dvc", "exp", "run", "--queue", "-S", values, "-S", "decimate.resolution=16", "evaluate@actor")
    project.run("dvc", "queue", "start", "-j", "2")
    end = time.monotonic() + 240
    while any(word in project.run("dvc", "queue", "status") for word in ("Queued", "Running")):
        assert time.monotonic() < end
        time.sleep(2)
    project.run("dvc", "queue", "stop", "--kill")
    return runs_of(json.loads(project.run("dvc", "exp", "show", "--json")))[0], project.stages_run()


def test_a_failed_cell_does_not_lose_the_others(grid: tuple[list[Run], Counter[str]]) -> None:
    found = {run.params["texture.resolution"]: run for run in grid[0] if run.params["decimate.resolution"] == 16}
    assert set(found) == {13, 128}
    assert found[13].error and not found[13].figures
    assert not found[128].error
    assert found[128].figures["psnr_subject"] == pytest.approx(10 + 16 / 10 + 128 / 100)
    assert found[128].figures["bytes"] == 16 + 100 * 128


def test_the_working_folder_has_a_row_too(grid: tuple[list[Run], Counter[str]]) -> None:
    own = [run for run in grid[0] if run.experiment == "workspace"]
    assert [dict(run.params) for run in own] == [{"decimate.resolution": "auto", "texture.resolution": "auto"}]


def test_cached_stages_do_not_run_again(grid: tuple[list[Run], Counter[str]]) -> None:
    assert not set(grid[1]) & {"capture", "normalize", "train", "sample", "reconstruct"}
    assert grid[1]["texture"] == 2 and grid[1]["evaluate"] == 1
