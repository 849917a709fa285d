"""Many subjects, or a grid of parameters, at once: on this machine or on a cluster (docs/guide/clusters.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from dask.utils import parse_bytes
from dvc.config import Config

from facefolds_core.cli.mending import mend
from facefolds_core.cluster.engine import cluster_of, default_jobs, run_jobs
from facefolds_core.cluster.job import Job, Outcome
from facefolds_core.cluster.jobs import read_grid, record, subject_jobs, sweep_jobs
from facefolds_core.cluster.table import Run, figures_of, write_runs
from facefolds_core.config.params_file import load_params
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import write_text

LOGS = Path(".dvc", "tmp", "jobs", "logs")


def command(
    subjects: Annotated[str, typer.Option(help="Names, with commas. Left out: all of params.yaml.")] = "",
    sweep: Annotated[Path | None, typer.Option(help="YAML: keys and lists of values; every combination runs.")] = None,
    jobs: Annotated[int, typer.Option("--jobs", "-j", help="At once. 0: one for two cores.", min=0)] = 0,
    scheduler: Annotated[
        str | None, typer.Option(help="tcp://HOST:8786, ssh:HOST,HOST, or slurm, pbs, sge, lsf, ...")
    ] = None,
    memory: Annotated[str, typer.Option(help="What a job needs: 14GB. Left out: not looked at.")] = "0",
    gpu: Annotated[int, typer.Option(help="GPUs that a job needs.", min=0)] = 0,
    remote: Annotated[bool, typer.Option("--remote", help="Results through DVC's default remote in any case.")] = False,
    to: Annotated[str, typer.Option(help="The last stage.")] = "evaluate",
    out: Annotated[Path, typer.Option(help="Table of a sweep: .parquet or .csv.")] = Path("sweep.parquet"),
) -> None:
    """Run subjects at once, each in a folder of its own; results and dvc.lock are as of `dvc repro`."""
    with report_user_errors("run"):
        root = Path.cwd()
        params = load_params("params.yaml")
        for line in mend(root):
            typer.echo(f"run: {line}")
        names = [name.strip() for name in subjects.split(",") if name.strip()] or list(params.subjects)
        cells = sweep_jobs(params, root, names, to, read_grid(sweep)) if sweep else {}
        todo = list(cells) or subject_jobs(params, root, names, to)
        try:
            needs = {"memory": float(parse_bytes(memory)), "gpu": float(gpu)}
        except ValueError as error:
            raise UserError("not an amount of memory", place="--memory", found=memory, expected="14GB") from error
        outcomes = _run_all(root, todo, scheduler, jobs or default_jobs(), needs, remote)
        if sweep:
            _keep_sweep(out, outcomes, cells)
        else:
            pull = remote or (scheduler is not None and "remote" in Config(str(root / ".dvc"))["core"])
            _record(root, outcomes, pull, everybody=set(names) == set(params.subjects))
        _print_table(outcomes)
        if any(outcome.error for outcome in outcomes):
            raise typer.Exit(1)


def _run_all(
    root: Path,
    todo: Sequence[Job],
    scheduler: str | None,
    jobs: int,
    needs: Mapping[str, float],
    remote: bool,
) -> list[Outcome]:
    """Outcomes in the order of `todo`; each is told of when it comes."""

    def tell(event: Mapping[str, str]) -> None:
        typer.echo(f"run: {event['job']}: {event['stage']} on {event['host']}")

    found, at_once = {}, min(jobs, len(todo))
    with cluster_of(scheduler, at_once, root) as client:
        watch = f"dashboard: {client.dashboard_link}" if find_spec("bokeh") else "a dashboard: pip install bokeh"
        where = scheduler or f"this machine, {at_once} at once"
        typer.echo(f"run: {len(todo)} jobs on {where}; {watch}")
        for outcome in run_jobs(client, root, todo, needs=needs, remote=remote, tell=tell):
            found[outcome.job] = outcome
            log = LOGS / f"{outcome.job.name}.log"
            log.parent.mkdir(parents=True, exist_ok=True)
            write_text(log, outcome.log)
            typer.echo(f"run: {outcome.job.name}: {outcome.state} after {outcome.seconds:.0f} s")
            if outcome.error:
                told = outcome.error.replace("\n", "\n  ")
                typer.echo(f"  {told}\n  all of it in {log}; the same command runs only what failed again")
    return [found[job] for job in todo]


def _record(root: Path, outcomes: Sequence[Outcome], pull: bool, everybody: bool) -> None:
    good = [outcome for outcome in outcomes if not outcome.error]
    if not good:
        return
    ran, error = record(root, good, pull, everybody and len(good) == len(outcomes))
    if ran:
        typer.echo(f"run: note: not found in the cache, so made here: {', '.join(ran)}")
    if error:
        found = f"\n{error}"
        raise UserError("results are in the cache, but not recorded", found=found, remedy="run the same command again")


def _keep_sweep(out: Path, outcomes: Sequence[Outcome], cells: Mapping[Job, Mapping[str, object]]) -> None:
    write_runs(
        out,
        [Run(o.job.name, o.job.subject, "", cells[o.job], figures_of(o.metrics or {}), o.error) for o in outcomes],
    )
    typer.echo(f"run: {out}")


def _print_table(outcomes: Sequence[Outcome]) -> None:
    width = max(len(outcome.job.name) for outcome in outcomes)
    typer.echo(f"\n{'job':{width}}  state   seconds  PSNR, dB       bytes")
    for outcome in outcomes:
        figures = figures_of(outcome.metrics or {})
        score = figures.get("psnr_subject", figures.get("psnr"))
        told = f"{'-' if score is None else f'{score:.2f}':>8}  {figures.get('bytes', 0):>10.0f}"
        typer.echo(f"{outcome.job.name:{width}}  {outcome.state:6}  {outcome.seconds:>7.0f}  {told}")
