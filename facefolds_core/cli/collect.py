"""Collect the experiments of `dvc exp run` into one table: `facefolds collect --out sweep.parquet`."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import read_json
from facefolds_core.sweeps.experiments import runs_of
from facefolds_core.sweeps.table import write_runs


def shown_experiments() -> object:
    """What `dvc exp show --json` says in this folder.

    Raises:
        UserError: with DVC's own message, if it fails.
    """
    command = [sys.executable, "-m", "dvc", "exp", "show", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UserError(
            "`dvc exp show` failed",
            found=done.stderr.strip()[-500:],
            remedy="run this in the project's root folder, a git checkout",
        )
    return json.loads(done.stdout)


def command(
    out: Annotated[Path, typer.Option(help="Table to write: .parquet or .csv.")] = Path("sweep.parquet"),
    shown: Annotated[
        Path | None, typer.Option("--from", help="Output of `dvc exp show --json`, kept earlier or elsewhere.")
    ] = None,
) -> None:
    """One row an experiment and subject: parameters that differ, scores of the asset, costs, and what failed."""
    with report_user_errors("collect"):
        runs, pending = runs_of(read_json(shown) if shown else shown_experiments())
        write_runs(out, runs)
        failed = [run for run in runs if run.error]
        typer.echo(f"collect: {len(runs) - len(failed)} measured, {len(failed)} failed, {pending} not ended yet; {out}")
        for run in failed:
            params = ", ".join(f"{name} {json.dumps(value)}" for name, value in run.params.items())
            typer.echo(
                f"  failed: {run.experiment}, {run.subject} ({params}); `dvc queue logs {run.experiment}` says why"
            )
