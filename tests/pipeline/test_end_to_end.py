"""`dvc repro` on a tiny actor: every stage, what a change reruns, interruption, and mistakes on the way."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

import pytest

from tests.pipeline.test_dvc_yaml import STAGES
from tests.pipeline.tiny import PARAMS, TinyProject


def test_it_ends_with_scores_and_pictures(project: TinyProject) -> None:
    folder = project.root / "data" / "actor"
    metrics = json.loads((folder / "metrics.json").read_text())
    for variant in ("model", "diffuse", "asset"):
        assert all(5 < metrics[variant][name] < 60 for name in ("psnr", "psnr_subject")), variant
    assert metrics["cost"]["triangles"] > 0
    assert (folder / "evaluation" / "contact_sheet.png").stat().st_size > 1000
    assert (folder / "evaluation" / "per_image.parquet").exists()


def test_nothing_to_do(project: TinyProject) -> None:
    assert "Running stage" not in project.done("dvc", "repro", "evaluate@actor")


def test_a_killed_training_resumes(project: TinyProject) -> None:
    for stage in ("capture", "normalize", "subject"):
        assert project.stage_here(stage, "stabilised")[0] == 0
    folder = project.root / "data" / "stabilised"
    process = project.start("dvc", "repro", "--single-item", "train@stabilised")
    deadline = time.monotonic() + 120
    while not list(folder.glob("checkpoints/*/checkpoint.safetensors")) and time.monotonic() < deadline:
        assert process.poll() is None, process.communicate()[0]
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not (folder / "model").exists()
    assert "continuing from iteration" in project.done("dvc", "repro", "--single-item", "train@stabilised")
    assert (folder / "model" / "model.safetensors").exists()


def test_a_stabilised_capture_runs_to_the_end(project: TinyProject) -> None:
    """The one whose training was killed, without DVC from there on."""
    for stage in STAGES[STAGES.index("sample") :]:
        status, output = project.stage_here(stage, "stabilised")
        assert status == 0, output
    metrics = json.loads((project.root / "data" / "stabilised" / "metrics.json").read_text())
    assert metrics["images"] == 4  # two held-out cameras, two frames


@pytest.fixture(scope="module")
def unfinished(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> TinyProject:
    """A project to make mistakes in."""
    return TinyProject(project_root, tmp_path_factory.mktemp("mistakes"))


@pytest.mark.parametrize(
    ("params", "says"),
    [
        (PARAMS.replace("{every: 4}", "[nobody]"), "nobody"),
        (PARAMS.replace("normalize: {}", "normalize: {max_azimuth: 0.001, max_elevation: 0.001}"), "azimuths up to"),
        pytest.param(  # one camera is left, and trained on
            PARAMS.replace("normalize: {}", "normalize: {max_azimuth: 0.001}"), "azimuth", marks=pytest.mark.nightly
        ),
        (PARAMS + "texure: {}\n", "texure"),
    ],
)
def test_mistakes_in_params_stop_with_one_message(unfinished: TinyProject, params: str, says: str) -> None:
    unfinished.write_params(params)
    runs = (unfinished.stage_here(stage) for stage in STAGES)
    status, output = next((status, output) for status, output in runs if status)
    assert status == 1
    assert says in output and "Traceback" not in output


def test_a_mistake_stops_dvc(unfinished: TinyProject) -> None:
    unfinished.write_params(PARAMS.replace("subjects:", "subjects: ["))
    status, output = unfinished.repro("evaluate@actor")
    assert status != 0
    assert "line" in output and "Traceback" not in output


DAMAGE = [
    ("subject", "scene/frames.arrow"),
    ("train", "scene/frames.arrow"),
    ("train", "scene/scene.json"),
    ("sample", "model/model.safetensors"),
    ("sample", "model/model.json"),
    ("reconstruct", "samples/grids.npz"),
    ("decimate", "surfaces/surfaces.npz"),
    ("texture", "samples/textures.arrow"),
    ("bake", "resampled/textures.arrow"),
    ("bake", "meshes/meshes.npz"),
    ("compress", "meshes/meshes.npz"),
    ("compress", "textures/textures.arrow"),
    ("evaluate", "subject/mattes.arrow"),
    ("evaluate", "asset/manifest.json"),
    ("evaluate", "asset/full.mp4"),
    ("evaluate", "asset/full_meshes.bin"),
    ("evaluate", "model/training.json"),
]


@pytest.mark.parametrize(("stage", "name"), DAMAGE)
def test_a_truncated_input_stops_a_stage_with_one_message(project: TinyProject, stage: str, name: str) -> None:
    path = project.root / "data" / "actor" / name
    content = path.read_bytes()
    path.unlink()
    path.write_bytes(content[: len(content) // 2])
    try:
        status, output = project.stage_here(stage)
    finally:
        path.unlink()
        path.write_bytes(content)
    assert status == 1, output
    assert path.name in output and "remedy" in output and "Traceback" not in output
