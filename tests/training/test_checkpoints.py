"""Checkpoints of the perceptrons' training: interruption, divergence, foreign and damaged ones, a full disk."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import train_params
from facefolds_core.training import loop
from facefolds_core.training.checkpoints import CHECKPOINT, fingerprint, load_checkpoint, save_checkpoint
from tests.scenes import OPAQUE, make_scene
from tests.training.test_training import params, run, state_for


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return make_scene(tmp_path_factory.mktemp("scene"), OPAQUE, size=24, surface_radius=0.33)


class Killed(BaseException):
    """Stands for a signal that ends the process."""


@pytest.mark.parametrize("log_lost", [False, True])
def test_an_interrupted_run_ends_at_the_same_result(
    scene: Scene, tmp_path: Path, log_lost: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = params(manifold_start="surface", checkpoint_seconds=1e-9)
    monkeypatch.setattr("facefolds_core.training.start.ITERATIONS", 5)
    whole = run(scene, settings, tmp_path / "whole")
    step = loop.train_step

    def interrupted(state: loop.TrainingState, *rest: object) -> object:
        if state.iteration == 7:
            raise Killed
        return step(state, *rest)

    monkeypatch.setattr(loop, "train_step", interrupted)
    with pytest.raises(Killed):
        run(scene, settings, tmp_path / "parts")
    assert not (tmp_path / "parts" / "model").exists()
    monkeypatch.setattr(loop, "train_step", step)
    if log_lost:  # `dvc repro` deletes a stage's outputs before it runs the stage again
        shutil.rmtree(tmp_path / "parts" / "log")
    resumed = run(scene, settings, tmp_path / "parts")
    assert "continuing from iteration 7" in capsys.readouterr().out
    assert whole.keys() == resumed.keys()
    assert all(torch.equal(whole[name], resumed[name]) for name in whole)


def test_divergence_is_caught_and_the_last_checkpoint_kept(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = params(checkpoint_seconds=1e-9)
    step = loop.train_step

    def poisoned(state: loop.TrainingState, *rest: object) -> object:
        if state.iteration == 5:
            with torch.no_grad():
                state.model.textures.base.bias[0] = float("nan")
        return step(state, *rest)

    monkeypatch.setattr(loop, "train_step", poisoned)
    with pytest.raises(UserError, match="not finite") as caught:
        run(scene, settings, tmp_path)
    assert "iteration 5" in str(caught.value) and "lr_manifold" in str(caught.value.remedy)
    kept = load_file(tmp_path / "checkpoints" / fingerprint(settings, scene) / CHECKPOINT)
    assert all(t.isfinite().all() for t in kept.values())
    assert not (tmp_path / "model").exists()


@pytest.mark.parametrize(
    ("asked", "values", "cut", "message", "fields"),
    [
        ("bbbb", {}, None, "another configuration", {"expected": "bbbb", "found": "aaaa"}),
        ("aaaa", {"texture_width": 20}, None, "does not belong", {"expected": "shape"}),
        ("aaaa", {}, -10, "damaged", {"file": CHECKPOINT, "remedy": "delete"}),
    ],
    ids=["another configuration", "another architecture", "cut off"],
)
def test_a_checkpoint_that_cannot_be_taken_up_is_refused(
    scene: Scene, tmp_path: Path, asked: str, values: dict, cut: int | None, message: str, fields: dict[str, str]
) -> None:
    state, sampler = state_for(scene, params())
    loop.train_step(state, sampler, params())
    path = save_checkpoint(state, "aaaa", tmp_path)
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(UserError, match=message) as caught:
        load_checkpoint(state_for(scene, params(**values))[0], asked, tmp_path)
    for name, words in fields.items():
        assert words in str(getattr(caught.value, name)), name


def test_fingerprint_tells_configurations_and_scenes_apart(scene: Scene, tmp_path: Path) -> None:
    other = make_scene(tmp_path, OPAQUE, size=20)
    marks = {fingerprint(params(), scene), fingerprint(params(seed=1), scene), fingerprint(params(), other)}
    assert len(marks) == 3
    assert fingerprint(params(device="cpu", checkpoint_seconds=5.0), scene) == fingerprint(params(), scene)


@pytest.mark.parametrize(
    "values", [{"textures": {"smooth_every": 4}}, {"follow": {"steps": 3}}, {"geometry": {"rounds": [2.0]}}]
)
def test_the_fingerprint_of_the_explicit_model_has_its_nested_keys(scene: Scene, values: dict[str, object]) -> None:
    usual = train_params({"preset": "fast"})
    assert fingerprint(train_params({"preset": "fast", **values}), scene) != fingerprint(usual, scene)
