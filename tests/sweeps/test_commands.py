"""`facefolds recommend` and `facefolds collect` as commands: what they print and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from click.testing import Result
from typer.testing import CliRunner

from facefolds_core.cli.collect import command as collect
from facefolds_core.cli.recommend import command as choose
from facefolds_core.params import DecimateParams
from facefolds_core.params_file import load_params
from facefolds_core.sweeps.table import Run, read_runs, write_runs
from tests.sweeps.test_experiments import SHOWN


def call(command: object, *arguments: str) -> Result:
    app = typer.Typer()
    app.command()(command)  # type: ignore[type-var]
    return CliRunner().invoke(app, arguments)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    runs = [
        Run(
            f"r{r}",
            "actor",
            params={"decimate.resolution": r},
            figures={"bytes": 1000.0 * r, "psnr_subject": 20 + r / 10},
        )
        for r in (8, 16, 32)
    ]
    write_runs(tmp_path / "sweep.csv", runs)
    return tmp_path / "sweep.csv"


def test_a_recommendation_is_printed_and_written(table: Path, project_root: Path) -> None:
    params = table.with_name("params.yaml")
    params.write_text((project_root / "params.yaml").read_text())
    done = call(choose, str(table), "--max-bytes", "2e4", "--write", "--params", str(params))
    assert done.exit_code == 0, done.output
    assert "r16" in done.output and "decimate.resolution: 16" in done.output and "psnr_subject, 21.60 dB" in done.output
    section = load_params(params).stage("decimate", "actor")
    assert isinstance(section, DecimateParams) and section.resolution == 16


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--max-bytes", "10"], "bytes 8000 at least (r8)"),
        (["--min-psnr", "40"], "at most 23.20 dB"),
        ([], "neither a budget nor a quality"),
        (["--max-bytes", "1e6", "--subject", "anna"], "no rows of this subject"),
    ],
)
def test_what_cannot_be_had_is_said(arguments: list[str], says: str, table: Path) -> None:
    done = call(choose, str(table), *arguments)
    assert done.exit_code == 1 and says in done.output


def test_two_subjects_need_a_name(table: Path) -> None:
    write_runs(table, [*read_runs(table), Run("x", "anna", figures={"bytes": 1.0, "psnr_subject": 1.0})])
    assert "which subject?" in call(choose, str(table), "--min-psnr", "1").output
    assert "recommend: anna, x" in call(choose, str(table), "--min-psnr", "1", "--subject", "anna").output


def test_collecting_names_what_failed_and_what_has_not_ended(tmp_path: Path) -> None:
    (tmp_path / "shown.json").write_text(json.dumps(SHOWN))
    done = call(collect, "--from", str(tmp_path / "shown.json"), "--out", str(tmp_path / "sweep.parquet"))
    assert done.exit_code == 0, done.output
    assert "2 not ended yet" in done.output and "dvc queue logs broken" in done.output
    assert {run.experiment for run in read_runs(tmp_path / "sweep.parquet")} >= {
        "workspace",
        "coarse",
        "fine",
        "broken",
    }
