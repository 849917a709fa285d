"""The commands' own work: what is planned, what is not measured again, that a failure is kept and the rest goes on."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from bench import hazards, speed_accuracy, sweeps
from bench.hazard_rows import HAZARDS, Hazard
from bench.results import Cell, Measurement, Row, Store
from bench.run import Project
from facefolds_core.cluster.table import Run
from facefolds_core.errors import UserError
from facefolds_core.files.writing import write_json
from tests.scoring.fakes import FRAMES, flat_scene, half_mask


def invoke(main: Any, *arguments: str) -> Any:
    app = typer.Typer()
    app.command()(main)
    return CliRunner().invoke(app, arguments)


def diverge(*_: object, **__: object) -> None:
    raise UserError("training diverged", remedy="none")


def diverge_in_training(_: Project, *stages: str) -> None:
    if "train" in stages:
        diverge()


def test_the_clean_case_and_the_middle_strength_come_first() -> None:
    planned = hazards.plan("film", ["gloss"], ["fast", "paper"], 2)
    first = [("film", "clean", 0, "fast", 0), *(("film", "gloss", s, "fast", 0) for s in (4, 8, 2))]
    assert [c.key for c in planned[:4]] == first
    assert len({c.key for c in planned}) == len(planned) == 16 and planned[8].seed == 1
    assert len(hazards.plan("film", [], ["fast"], 1)) == 1 + 3 * len(HAZARDS)
    assert len(hazards.plan("film", [], ["fast", "paper"], 0)) == 4 * (1 + 3 * len(HAZARDS))


def test_what_must_be_filmed_is_none_of_a_prepared_scenes() -> None:
    assert {c.hazard for c in hazards.plan("mugsy", [], ["fast"], 1)} >= {"cameras", "centre", "spacing"}
    for names, presets in ((["gloss"], ["fast"]), (["rain"], ["fast"]), ([], ["slow"])):
        with pytest.raises(UserError, match="no such row or preset"):
            hazards.plan("mugsy", names, presets, 1)


def test_a_failed_training_is_a_cell(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(hazards, "disturbed", lambda *_: (None, None))
    monkeypatch.setattr(hazards, "write_shots", lambda *_: None)
    monkeypatch.setattr(hazards, "train", diverge)
    made = hazards.run_cell(Cell(hazard="gloss", strength=4, preset="fast", seed=0), tmp_path, tmp_path)
    assert made.failure == "training diverged" and made.psnr is None and not made.converged


def test_rates_multiply_the_usual_values(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = Project(tmp_path, "cell")
    written: list[dict[str, Any]] = []
    usual = {"model": "explicit", "lr": 0.5, "inner": {"width": 2.0}}
    write_json(project.folders.config / "train.json", usual)
    monkeypatch.setattr(Project, "run", lambda *_: None)
    monkeypatch.setattr(Project, "write", lambda _, params: written.append(params["subjects"]["cell"]["train"].copy()))
    blank = Cell(subject="mugsy", hazard="x", strength=3, preset="fast", seed=7)
    scaled = (("mlp", "other"), ("explicit", "lr"), ("explicit", "inner.width"), ("explicit", "inner.none"))
    hazards.train(project, blank, Hazard("x", "x", (1, 2, 3), "{}", scaled=scaled))
    assert written[-1] == {"preset": "fast", "seed": 7, "lr": 1.5, "inner": {"width": 6.0}}


def test_a_flat_silhouette(tmp_path: Path) -> None:
    scene = flat_scene(tmp_path, masks={k: half_mask() for k in range(FRAMES)})
    # Noise of all codes about its mean: 255 / sqrt(12) of 255.
    assert hazards.flat(scene, ["front"]) == pytest.approx(10 * np.log10(12), abs=0.2)
    assert hazards.flat(scene, []) == 0


def test_hazards_go_on_where_they_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[object, ...]] = []

    def measured(blank: Cell, *_: Path) -> Cell:
        made.append(blank.key)
        if len(made) == 3:
            raise KeyboardInterrupt
        return blank.model_copy(update={"psnr": 20.0})

    monkeypatch.setattr(hazards, "run_cell", measured)
    path = tmp_path / "cells.json"
    arguments = ["--only", "gloss", "--presets", "fast", "--seeds", "1", "--results", str(path)]
    invoke(hazards.main, *arguments)
    assert len(Store(path, "cells", Cell).read()) == 2
    assert invoke(hazards.main, *arguments).exit_code == 0
    assert made == [*made[:3], made[2], ("film", "gloss", 2, "fast", 0)]
    assert "glossy skin" in invoke(hazards.main, *arguments, "--draw-only").output


def test_trainings_that_are_there_are_not_measured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Project, "run", diverge_in_training)
    monkeypatch.setattr(speed_accuracy.charts, "speed", lambda *_: None)
    given = {"presets": "fast", "results": tmp_path / "r.json", "work": tmp_path, "clock": "processor"}
    arguments = [f"--{name}={value}" for name, value in given.items()]
    for wanted in ("5", "5,7", "5,7"):
        assert invoke(speed_accuracy.main, *arguments, "--iterations", wanted).exit_code == 0
    found = Store(tmp_path / "r.json", "measurements", Measurement).read()
    assert [m.iterations for m in found] == [5, 7]
    assert {(m.failure, m.conditions.clock) for m in found} == {("training diverged", "processor")}


def test_finer_textures_are_sampled_as_finely() -> None:
    given = {"compress.levels": []}
    assert sweeps.changes("texture", 128, "actor") == {"texture.resolution": 128, **given}
    finer = {"sample.resolution": 1024, "reconstruct.resolution": 512}
    assert sweeps.changes("texture", 1024, "actor") == {"texture.resolution": 1024, **given, **finer}


@pytest.mark.parametrize("arguments", [("wind",), ("mesh", "--values", "ten"), ("mesh", "--values", "0")])
def test_a_sweep_that_is_none(arguments: tuple[str, ...]) -> None:
    assert invoke_app("queue", *arguments).exit_code == 1


def test_dvc_says_why_it_does_not_queue(monkeypatch: pytest.MonkeyPatch) -> None:
    refused = subprocess.CompletedProcess([], 1, "", "ERROR: already there")
    monkeypatch.setattr(sweeps.subprocess, "run", lambda *_, **__: refused)
    done = invoke_app("queue", "mesh")
    assert done.exit_code == 1 and "already there" in done.output


def test_what_became_of_experiments_is_kept_failures_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    figures = {"psnr": 11.0, "psnr_subject": 24.0, "mesh_bytes": 10.0, "texture_bytes": 10.0, "bytes": 30.0}
    runs = [
        Run("mesh-actor-32", "actor", "abc", figures=figures),
        Run("mesh-actor-32", "mugsy", "abc", figures=figures),  # shown beside the experiment's own subject
        Run("mesh-actor-16", "actor", "abc", error="training diverged"),
        Run("brisk-otter", "actor", "abc", figures=figures),
    ]
    monkeypatch.setattr(sweeps, "shown_experiments", lambda: None)
    monkeypatch.setattr(sweeps, "runs_of", lambda _: (runs, 2))
    monkeypatch.setattr(sweeps, "DVCFileSystem", Files)
    monkeypatch.setattr(sweeps, "drawing_speed", lambda _: (8.5, "llvmpipe"))
    path = tmp_path / "rows.json"
    done = invoke_app("collect", "--results", str(path))
    assert done.exit_code == 0 and "2 not ended" in done.output
    row, failed = Store(path, "rows", Row).read()
    assert (row.value, row.psnr, row.bytes, row.renderer) == (32, 24.0, 20, "llvmpipe")
    assert row.figures == {**figures, "pictures_a_second": 8.5} and row.params == {"decimate.resolution": 32}
    assert (failed.value, failed.failure) == (16, "training diverged")


class Files:
    """In place of DVC's file system of a revision."""

    def __init__(self, _: str, rev: str) -> None:
        assert rev == "abc"

    def get(self, source: str, target: str, recursive: bool) -> None:
        assert source == "data/actor/asset" and recursive


def invoke_app(*arguments: str) -> Any:
    return CliRunner().invoke(sweeps.app, arguments)
