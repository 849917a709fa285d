"""Sweeps: what a cell runs and what it finds done, and that a failed one does not lose the others."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bench import sweep_cells, sweeps
from bench.sweep_cells import MADE, RUN, Cell, asset_scores, own_metrics, plan, run_stages
from bench.sweep_rows import Row, read_rows
from bench.sweeps import SWEEPS, as_run, chosen_values, run_sweep
from facefolds_core.errors import UserError
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.metrics import MAX_PSNR
from facefolds_core.scoring.perceptual import Perceptual
from tests.scoring.fakes import FRAMES, SIZE, flat_asset, flat_scene, pictures


@pytest.fixture
def subject(tmp_path: Path) -> Path:
    """A subject's folder with all that stages make, as small files."""
    root = tmp_path / "actor"
    for name in ("scene", *(name for names in MADE.values() for name in names)):
        path = root / name if "." in name else root / name / "file"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)
    for stage in [*RUN, "evaluate"]:
        folder = SubjectFolders(root).config
        folder.mkdir(parents=True, exist_ok=True)
        section = {"resolution": 64} if stage != "compress" else {"levels": [1]}
        (folder / f"{stage}.json").write_text(json.dumps(section))
    return root


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the stages that run, in order; they write what they should."""
    names: list[str] = []

    def stand_in(stage: str) -> Callable[[SubjectFolders], str]:
        def run(folders: SubjectFolders) -> str:
            names.append(stage)
            for made in MADE[stage]:
                assert not (folders.root / made).exists()
                (folders.root / made).write_text((folders.config / f"{stage}.json").read_text())
            return "done"

        return run

    monkeypatch.setattr(sweep_cells, "RUN", {stage: stand_in(stage) for stage in RUN})
    return names


def run(cell: Cell) -> SubjectFolders:
    return run_stages(cell, lambda _: None)[0]


def test_a_cell_runs_from_the_stage_that_changes(
    subject: Path, tmp_path: Path, ran: list[str], project_root: Path
) -> None:
    folders = run(SWEEPS["mesh"].cell(16, subject, tmp_path / "work"))
    assert ran == ["decimate", "texture", "bake", "compress"]
    assert json.loads((folders.root / "meshes").read_text())["resolution"] == 16
    assert json.loads((folders.root / "asset").read_text())["levels"] == []
    assert (folders.root / "surfaces" / "file").read_text() == "surfaces"
    assert (subject / "meshes" / "file").read_text() == "meshes"


def test_what_ran_is_not_run_again_and_what_is_shared_runs_once(subject: Path, tmp_path: Path, ran: list[str]) -> None:
    sweep, work = SWEEPS["texture"], tmp_path / "work"
    run(sweep.cell(32, subject, work))
    run(sweep.cell(32, subject, work))
    assert ran == ["texture", "bake", "compress"]
    ran.clear()
    run(sweep.cell(128, subject, work))
    assert ran == ["sample", "reconstruct", "decimate", "texture", "bake", "compress"]


def test_an_interrupted_stage_runs_again(subject: Path, tmp_path: Path, ran: list[str]) -> None:
    cell = SWEEPS["texture"].cell(32, subject, tmp_path / "work")
    folders = run(cell)
    folders.timing("compress").unlink()
    ran.clear()
    run(cell)
    assert ran == ["compress"]


def test_the_subjects_own_configuration_is_taken_as_it_is(subject: Path, tmp_path: Path) -> None:
    (subject / "metrics.json").write_text(
        json.dumps({"asset": {"psnr": 20.0}, "cost": {"triangles": 7, "device": "cpu", "train_seconds": 1.5}})
    )
    assert own_metrics(SWEEPS["mesh"].cell(64, subject, tmp_path)) == ({"psnr": 20.0}, {"triangles": 7})
    assert own_metrics(SWEEPS["mesh"].cell(32, subject, tmp_path)) is None
    (subject / "metrics.json").unlink()
    assert own_metrics(SWEEPS["mesh"].cell(64, subject, tmp_path)) is None


def test_the_key_follows_configuration_and_data(subject: Path, tmp_path: Path) -> None:
    def key(value: int) -> str:
        return plan(SWEEPS["mesh"].cell(value, subject, tmp_path))["evaluate"]

    first = key(16)
    assert key(16) == first and key(17) != first
    (SubjectFolders(subject).config / "bake.json").write_text('{"resolution": 65}')
    assert key(16) != first
    (SubjectFolders(subject).config / "bake.json").write_text('{"resolution": 64}')
    assert key(16) == first
    (subject / "surfaces" / "file").write_text("others")
    assert key(16) != first


def test_a_missing_start_is_said(subject: Path, tmp_path: Path) -> None:
    (subject / "surfaces" / "file").unlink()
    (subject / "surfaces").rmdir()
    with pytest.raises(UserError, match="start is missing"):
        plan(SWEEPS["mesh"].cell(16, subject, tmp_path))


def measured(_: object, sweep: sweeps.Sweep, value: int, cell: Cell) -> Row:
    if value == 13:
        raise RuntimeError("unlucky\nand more")
    identity = sweeps.identity(sweep, value, cell, plan(cell)["evaluate"])
    return Row(**identity, scores={"psnr": 20.0, "psnr_subject": 25.0}, cost=COST, export_seconds=3.0)


COST = {"triangles": 100, "mesh_bytes": 10, "texture_bytes": 20, "view_effects_bytes": 5, "gpu_bytes": 7}


def test_a_failed_cell_does_not_lose_the_others(
    subject: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sweeps, "in_a_process", measured)
    path, sweep = tmp_path / "rows.json", SWEEPS["mesh"]
    failed = run_sweep(sweep, subject, [16, 13, 8], tmp_path / "work", path, force=False)
    assert len(failed) == 1 and "mesh 13" in failed[0]
    rows = {row.value: row for row in read_rows(path)}
    assert rows[13].failure == "RuntimeError: unlucky" and rows[8].score("psnr") == 25.0
    run_sweep(sweep, subject, [16, 13, 8], tmp_path / "work", path, force=False)
    lines = capsys.readouterr().out.splitlines()
    assert sum("measured already" in line for line in lines) == 2
    assert sum("failed: RuntimeError" in line for line in lines) == 2
    assert len(read_rows(path)) == 3


def test_an_asset_at_twice_the_frame_rate_is_scored_at_the_photos(tmp_path: Path) -> None:
    twice = np.stack([pictures(), 255 - pictures()], 1).reshape(2 * FRAMES, SIZE, SIZE, 3)
    found = asset_scores(flat_scene(tmp_path), flat_asset(twice), (0.0, 0.0, 0.0), Perceptual(None, None, ()))
    assert [score.values["psnr"] for score in found] == [MAX_PSNR] * FRAMES


def test_a_row_as_a_recommendation_reads_it(subject: Path, tmp_path: Path) -> None:
    cell = SWEEPS["texture"].cell(128, subject, tmp_path)
    found = as_run(measured(None, SWEEPS["texture"], 128, cell))
    assert found.params == {"texture.resolution": 128, "sample.resolution": 128, "reconstruct.resolution": 64}
    assert found.figure("bytes") == 35 and found.quality == 25.0


def test_values_are_whole_numbers() -> None:
    assert chosen_values("", SWEEPS["layers"]) == [12, 8, 4, 1]
    assert chosen_values("3,2", SWEEPS["layers"]) == [3, 2]
    for text in ("a", "0", "4,-1"):
        with pytest.raises(UserError, match="whole numbers"):
            chosen_values(text, SWEEPS["layers"])


def test_help_names_the_commands() -> None:
    shown = CliRunner().invoke(sweeps.app, ["--help"])
    assert shown.exit_code == 0
    assert all(name in shown.output for name in ("layers", "mesh", "texture", "draw"))
