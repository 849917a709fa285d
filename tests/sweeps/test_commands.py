"""`facefolds collect` as a command: what it prints."""

from __future__ import annotations

import json
from pathlib import Path

import typer
from click.testing import Result
from typer.testing import CliRunner

from facefolds_core.cli.collect import command as collect
from tests.sweeps.tables import read_runs
from tests.sweeps.test_experiments import SHOWN


def call(command: object, *arguments: str) -> Result:
    app = typer.Typer()
    app.command()(command)  # type: ignore[type-var]
    return CliRunner().invoke(app, arguments)


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
