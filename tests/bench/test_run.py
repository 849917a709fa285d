"""A cell's project: its parameters, the stages that run in it, what they say when they fail, and scores of a model."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
import yaml

from bench.run import Project, own_params, score_model
from facefolds_core.errors import UserError
from facefolds_core.model.storage import save_model
from facefolds_core.scoring.perceptual import Perceptual
from tests.scoring.fakes import FRAMES, SPEC, flat_scene, half_mask, tiny_model


def test_a_subject_stands_alone_with_its_changes(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    own = {"source": "multiface", "path": "../film", "train": {"layers": 4}}
    subjects = {"a": own, "b": {"source": "actor", "path": "x"}}
    path.write_text(yaml.safe_dump({"subjects": subjects, "train": {"preset": "fast"}}))
    found = own_params("a", {"train": {"seed": 3}}, path)
    changed = {**own, "path": str(tmp_path.parent / "film"), "train": {"layers": 4, "seed": 3}}
    assert found["train"] == {"preset": "fast"} and found["subjects"] == {"a": changed}
    assert own_params("b", {}, path)["subjects"]["b"]["path"] == "x"  # in the copy of the project
    with pytest.raises(UserError, match="no such subject"):
        own_params("c", {}, path)


def test_a_stage_runs_on_the_projects_parameters_and_says_how_it_failed(tmp_path: Path) -> None:
    project = Project(tmp_path, "actor")
    project.write(own_params("actor", {"train": {"layers": 3}}))
    project.run("configure")
    assert yaml.safe_load((project.folders.config / "train.json").read_text())["layers"] == 3
    project.write(own_params("actor", {"train": {"layers": -3}}))
    with pytest.raises(UserError, match="a parameter is wrong") as caught:
        project.run("configure")
    assert caught.value.place == "configure of actor"


def test_a_model_is_scored_on_its_held_out_cameras(tmp_path: Path) -> None:
    scene = flat_scene(tmp_path / "scene", masks={0: half_mask()})
    (tmp_path / "model").mkdir()
    save_model(tiny_model(), SPEC, tmp_path / "model")
    times = {0: 0.0, FRAMES - 1: 1.5}
    found = list(score_model(tmp_path / "model", scene, times, Perceptual(), torch.device("cpu")))
    assert [(name, k) for name, k, _ in found] == [("front", 0), ("front", FRAMES - 1)]
    assert [v["psnr_subject"] is not None for _, _, v in found] == [True, False]
    assert all(v["psnr"] and 5 < v["psnr"] < 30 for _, _, v in found)
