"""The paper's three ablations on our own subjects: number of layers, mesh resolution R^m, texture resolution R^t.

python -m bench.sweeps layers          N = 12, 8, 4, 1: trains again
python -m bench.sweeps mesh            R^m = 512 ... 8, from the trained model
python -m bench.sweeps texture         R^t = 1024 ... 128, from the trained model
python -m bench.sweeps draw            the tables of docs/results.md and the charts, from what is there

A cell is the subject's own configuration with one value changed. It is kept in bench/results/sweeps.json and not
measured again while configuration, code and data are the same; stages that cells share run once (bench/sweep_cells.py).
A cell that fails is recorded and the others go on.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from bench.common import OWN_SUBJECTS, words
from bench.drawing_speed import pictures_a_second
from bench.processes import in_a_process
from bench.results import commit_name, machine_name
from bench.sweep_cells import Cell, measure, own_metrics, plan, run_stages
from bench.sweep_chart import draw, write_plot_data
from bench.sweep_rows import Name, Row, add_row, read_rows, with_tables
from facefolds_core.config import read_stage
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import write_text
from facefolds_core.model.device import pick_device
from facefolds_core.params import SampleParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.sweeps.table import Run, write_runs
from facefolds_core.training.report import device_name

PROJECT = Path(__file__).resolve().parents[1]
RESULTS = Path("bench/results/sweeps.json")
PICTURE = Path("docs/images/sweeps.png")
DOCUMENT = Path("docs/results.md")


@dataclass(frozen=True)
class Sweep:
    """One ablation.

    Attributes:
        stage, key: of the parameter whose values are compared.
        values: the paper's, and 8 layers.
        timed: export stages that a change of the parameter reruns.
    """

    name: Name
    stage: str
    key: str
    values: tuple[int, ...]
    timed: tuple[str, ...]

    def cell(self, value: int, subject: Path, work: Path) -> Cell:
        """The subject's own configuration with the value; a coarser level of detail is not measured and left out.

        Textures finer than the subject's samples would show no more: then it is sampled as finely, once, and its
        surfaces keep the vertices that they had.
        """
        overrides: dict[str, dict[str, Any]] = {self.stage: {self.key: value}, "compress": {"levels": []}}
        first = self.stage
        if self.name == "texture":
            samples = read_stage(SampleParams, SubjectFolders(subject).config).resolution
            if value > samples:
                overrides |= {"sample": {"resolution": value}, "reconstruct": {"resolution": samples}}
                first = "sample"
        return Cell(subject, work, overrides, first, PROJECT)


SWEEPS: dict[str, Sweep] = {
    "layers": Sweep(
        "layers", "train", "layers", (12, 8, 4, 1),
        ("sample", "reconstruct", "decimate", "texture", "bake", "compress"),
    ),
    "mesh": Sweep(
        "mesh", "decimate", "resolution", (512, 256, 128, 64, 32, 16, 8), ("decimate", "bake", "compress"),
    ),
    "texture": Sweep("texture", "texture", "resolution", (1024, 512, 256, 128), ("texture", "bake", "compress")),
}  # fmt: skip


def run_cell(sweep: Sweep, value: int, cell: Cell) -> Row:
    """Measure one cell, whatever it takes; called in a process of its own.

    The subject's own configuration is not run again: its figures are those of `dvc repro`, without our seconds.
    """
    key = plan(cell)["evaluate"]
    own = own_metrics(cell)
    if own is not None:
        drawn = speed(SubjectFolders(cell.subject))
        return Row(**identity(sweep, value, cell, key), scores=own[0], cost=own[1], **drawn)
    folders, seconds = run_stages(cell, lambda line: typer.echo(f"  {line}"))
    scores, cost = measure(folders)
    return Row(
        **identity(sweep, value, cell, key),
        scores=scores,
        cost=cost,
        **speed(folders),
        train_seconds=seconds.get("train", 0.0),
        export_seconds=round(sum(seconds[stage] for stage in sweep.timed), 3),
    )


def speed(folders: SubjectFolders) -> dict[str, Any]:
    """How fast the asset is drawn; nothing where there is no OpenGL."""
    try:
        pictures, renderer = pictures_a_second(folders)
    except UserError as error:
        typer.echo(f"  not drawn: {error}")
        return {}
    return {"pictures_a_second": round(pictures, 3), "renderer": renderer}


def identity(sweep: Sweep, value: int, cell: Cell, key: str) -> dict[str, Any]:
    """Of a row: which cell, and where and when it was measured."""
    changed = {f"{stage}.{k}": v for stage, keys in cell.overrides.items() for k, v in keys.items()}
    return {
        "sweep": sweep.name,
        "subject": cell.subject.name,
        "value": value,
        "params": {name: v for name, v in changed.items() if isinstance(v, int)},
        "key": key,
        "commit": commit_name(PROJECT),
        "machine": machine_name(device_name(pick_device("auto"))),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def run_sweep(sweep: Sweep, subject: Path, values: list[int], work: Path, results: Path, force: bool) -> list[str]:
    """Measure what is missing of a sweep on one subject, telling of each cell.

    Returns:
        the failed cells, in words.
    """
    failed = []
    for i, value in enumerate(values):
        title = f"[{i + 1}/{len(values)}] {sweep.name} {value}, {subject.name}"
        cell = sweep.cell(value, subject, work)
        key = plan(cell)["evaluate"]
        if not force and any(r.key == key and r.value == value and not r.failure for r in read_rows(results)):
            typer.echo(f"{title}: measured already")
            continue
        typer.echo(f"{title}: ...")
        try:
            row: Row = in_a_process(run_cell, sweep, value, cell)
        except Exception as error:  # whatever it is, it concerns this cell alone
            first = (str(error) or repr(error)).splitlines()[0]
            row = Row(**identity(sweep, value, cell, key), failure=f"{type(error).__name__}: {first}"[:300])
            failed.append(f"{title}: {error}")
        add_row(results, row)
        typer.echo(f"{title}: {describe(row)}")
    return failed


def describe(row: Row) -> str:
    if row.failure:
        return f"failed: {row.failure}"
    psnr, ssim, st_lpips = (row.score(name) for name in ("psnr", "ssim", "st_lpips"))
    shown = [f"{psnr:.2f} dB" if psnr is not None else "", f"SSIM {ssim:.3f}" if ssim is not None else ""]
    shown += [f"ST-LPIPS {st_lpips:.3f}" if st_lpips is not None else "", f"{row.cost['triangles']} triangles"]
    shown += [f"{row.cost['mesh_bytes']} + {row.cost['texture_bytes']} bytes"]
    seconds = row.train_seconds + row.export_seconds
    shown += [f"{seconds:.0f} s of processor time" if seconds else "the subject's own, as `dvc repro` left it"]
    shown += [f"{row.pictures_a_second:.1f} pictures/s" if row.pictures_a_second else ""]
    return ", ".join(part for part in shown if part)


def chosen_subjects(names: str, data: Path) -> list[Path]:
    """Folders of the subjects; without names, `actor`, and `mugsy` where it is there."""
    found = words(names) or [name for name in OWN_SUBJECTS if (data / name / "model").exists()] or [OWN_SUBJECTS[0]]
    for name in found:
        if not (data / name / "model").exists():
            raise UserError("no trained model", file=data / name, remedy=f"run `dvc repro evaluate@{name}` first")
    return [data / name for name in found]


def chosen_values(text: str, sweep: Sweep) -> list[int]:
    try:
        values = [int(part) for part in words(text)] or list(sweep.values)
    except ValueError:
        values = [0]
    if min(values) < 1:
        raise UserError("not a list of whole numbers", place="--values", expected="such as 64,32,16", found=text)
    return values


Subjects = Annotated[str, typer.Option(help="Comma-separated names; by default actor, and mugsy where it is there.")]
Values = Annotated[str, typer.Option(help="Comma-separated, in place of the paper's.")]
Data = Annotated[Path, typer.Option(help="Folder that holds one folder a subject, as `dvc repro` left it.")]
Work = Annotated[Path | None, typer.Option(help="Folder for the cells; <data>/<subject>/sweeps if left out.")]
ResultsFile = Annotated[Path, typer.Option(help="File that the rows are added to.")]
Force = Annotated[bool, typer.Option("--force", help="Score again what is there (stages that ran are not run again).")]

HELP = (__doc__ or "").replace("\n\n", "\n\n\b\n")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, help=HELP)


def add_command(sweep: Sweep, text: str) -> None:
    """A command of the sweep's name."""

    @app.command(sweep.name, help=text)
    def command(
        subjects: Subjects = "",
        values: Values = "",
        data: Data = Path("data"),
        work: Work = None,
        results: ResultsFile = RESULTS,
        force: Force = False,
    ) -> None:
        with report_user_errors("sweeps"):
            chosen = chosen_values(values, sweep)
            failed = []
            for subject in chosen_subjects(subjects, data):
                failed += run_sweep(sweep, subject, chosen, work or subject / "sweeps", results, force)
            typer.echo(f"sweeps: rows in {results}; `python -m bench.sweeps draw` makes tables and charts of them")
            if failed:
                raise UserError("cells that failed:\n" + "\n".join(failed))


add_command(SWEEPS["layers"], "Number of layers N: 12, 8, 4, 1. Trains a model for each, with the subject's preset.")
add_command(SWEEPS["mesh"], "Mesh resolution R^m: 512, 256, 128, 64, 32, 16, 8. Decimate, bake and compress for each.")
add_command(SWEEPS["texture"], "Texture resolution R^t: 1024, 512, 256, 128. Texture, bake and compress for each.")


@app.command("draw")
def draw_all(
    results: ResultsFile = RESULTS,
    picture: Annotated[Path, typer.Option(help="The chart; an SVG is written beside it.")] = PICTURE,
    document: Annotated[Path, typer.Option(help="Its tables are replaced, between their markers.")] = DOCUMENT,
) -> None:
    """Tables, charts, points for `dvc plots`, and a table for `facefolds recommend`, from what has been measured."""
    with report_user_errors("sweeps"):
        rows = read_rows(results)
        draw(rows, picture)
        draw(rows, picture.with_suffix(".svg"))
        write_plot_data(rows, results.parent)
        write_runs(results.with_suffix(".csv"), [as_run(row) for row in rows])
        write_text(document, with_tables(document.read_text(encoding="utf-8"), rows))
        typer.echo(
            f"sweeps: {picture}, {picture.with_suffix('.svg')}, tables in {document}, {results.with_suffix('.csv')}"
        )


def as_run(row: Row) -> Run:
    """A row as `facefolds recommend` reads it; what is not under `params` is as the subject has it."""
    figures = {name: value for name, value in row.scores.items() if value is not None}
    figures |= {name: float(value) for name, value in row.cost.items()}
    figures |= {"pictures_a_second": row.pictures_a_second} if row.pictures_a_second else {}
    if not row.failure:
        figures["bytes"] = float(row.bytes + row.cost["view_effects_bytes"])
    return Run(f"{row.sweep} {row.value}", row.subject, row.commit, row.params, figures, row.failure)


if __name__ == "__main__":
    app()
