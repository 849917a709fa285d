"""Pick a configuration from a sweep: `facefolds recommend --max-bytes 1e6 [--write]`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.cli.numbers import finite
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.sweeps.edit import set_for_subject
from facefolds_core.sweeps.experiments import VALIDATE
from facefolds_core.sweeps.recommend import Budget, judged_by, recommend
from facefolds_core.sweeps.table import Run, read_runs

SHOWN = ("psnr_over_plate", "psnr_subject", "psnr_found", "triangles", "bytes", "gpu_bytes", "video_bits_per_second")

HELD_OUT = (
    "  chosen by the held-out cameras, for want of others: its score there flatters it a little, the more so the more "
    "were tried; set `validate: {every: 8}` of this subject in params.yaml while you choose (docs/guide/subjects.md)"
)


def command(
    table: Annotated[Path, typer.Argument(help="Written by `facefolds collect`: Parquet or CSV.")] = Path(
        "sweep.parquet"
    ),
    subject: Annotated[str, typer.Option(help="Name of the subject; needed where the table has several.")] = "",
    max_bytes: Annotated[
        float | None, typer.Option(help="Of meshes, video and reflection together.", callback=finite)
    ] = None,
    max_triangles: Annotated[float | None, typer.Option(help="Of all layers.", callback=finite)] = None,
    max_gpu_bytes: Annotated[
        float | None, typer.Option(help="Of vertices, indices and a decoded picture.", callback=finite)
    ] = None,
    max_bit_rate: Annotated[
        float | None, typer.Option(help="Of the texture video, bits a second.", callback=finite)
    ] = None,
    min_psnr: Annotated[
        float | None,
        typer.Option(help="dB, of the figure that is gone by: it is printed.", callback=finite),
    ] = None,
    write: Annotated[bool, typer.Option("--write", help="Put it into params.yaml, for this subject.")] = False,
    params: Annotated[Path, typer.Option(help="The file that --write changes.")] = Path("params.yaml"),
) -> None:
    """The best measured configuration within a budget, or the smallest one that is good enough."""
    with report_user_errors("recommend"):
        runs = of_subject(read_runs(table), subject, table)
        run = recommend(runs, Budget(max_bytes, max_triangles, max_gpu_bytes, max_bit_rate), min_psnr)
        key = judged_by(runs)
        typer.echo(f"recommend: {run.subject}, {run.experiment} (by {key}, {run.figure(key):.2f} dB)")
        if not key.startswith(VALIDATE):
            typer.echo(HELD_OUT)
        for name, value in run.params.items():
            typer.echo(f"  {name}: {json.dumps(value)}")
        typer.echo("  " + ", ".join(f"{name} {value:g}" for name in SHOWN if (value := run.figure(name)) is not None))
        if write:
            set_for_subject(params, run.subject, run.params)
            typer.echo(f"recommend: written into {params}; `dvc repro evaluate@{run.subject}` makes the asset")


def of_subject(runs: list[Run], subject: str, table: Path) -> list[Run]:
    """Rows of the subject; without a name, of the only one.

    Raises:
        UserError: if there is none, or several and no name.
    """
    names = sorted({run.subject for run in runs})
    if subject not in names and (subject or len(names) != 1):
        raise UserError(
            "which subject?" if not subject else "no rows of this subject",
            file=table,
            place="--subject",
            expected=", ".join(names) or "a table with rows",
            found=subject or None,
            remedy="name one of these, or collect the sweep again",
        )
    return [run for run in runs if run.subject == (subject or names[0])]
