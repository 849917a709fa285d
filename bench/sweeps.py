"""The paper's ablations, and bytes against accuracy: a DVC experiment a cell, and what became of it.

python -m bench.sweeps queue mesh      layers, mesh, texture, or rate: the paper's export and ours at five rates
dvc exp run --run-all                  runs what was queued (or `dvc queue start -j 2`: docs/guide/sweeps.md)
python -m bench.sweeps collect         what has ended, into bench/results/sweeps.json
python -m bench.sweeps draw            the tables of docs/research/ablations.md and the charts, from what is there

A cell is the subject's own configuration with a few values changed. Stages that cells share run once.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from dvc.api import DVCFileSystem

from bench import charts
from bench.experiments import runs_of, shown_experiments
from bench.results import Row, Store, commit_name, machine_name, now
from bench.run import own_params
from bench.tables import AXES, RATES, rate_tables, replace_between, sweep_table
from facefolds_core.asset import read_asset
from facefolds_core.cluster.table import Run, write_runs
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.export.sampling import LEAST
from facefolds_core.rendering.camera_paths import Eye, camera_of, turntable
from facefolds_core.rendering.opengl import OpenGLRenderer

RESULTS = Path("bench/results/sweeps.json")
IMAGES = Path("docs/images")
DOCUMENT = Path("docs/research/ablations.md")
RATE_FRAMES = 60
"""Of the actor: codecs are compared honestly only on sequences of real length."""
FACTORS = (17, 22, 27, 32, 38)
"""Constant rate factors, on x264's scale."""


class Sweep(NamedTuple):
    """A key of params.yaml and its values; what else differs from the subject's own configuration."""

    key: str
    values: tuple[int, ...]
    fixed: Mapping[str, Any]


RATE = "compress.video.crf"
QUANTISED: dict[str, Any] = {"compress.mesh.max_error_pixels": 0.2, "compress.mesh.compression_level": 10}
PAPER_EXPORT: dict[str, Any] = {
    **{"sample.resolution": 1024, "sample.window": "full"},
    **{"reconstruct.method": "poisson", "reconstruct.resolution": 512},
    **{"decimate.resolution": 32, "decimate.uv": "nearest", "texture.resolution": 1024, "bake.hold": 0},
    **{"compress.mesh.max_error_pixels": None, "compress.mesh.quantization_bits": 0},
    **{"compress.mesh.compression_level": 0, "compress.video.codec": "h264", "compress.video.preset": "medium"},
}
"""The whole hemisphere, Poisson, the nearest sample's texture coordinates, Draco without loss. It goes through the same
writer as ours, which crops layers and leaves out what shows nothing: that flatters it."""
SWEEPS: dict[str, Sweep] = {
    "layers": Sweep("train.layers", (12, 8, 4, 1), {}),
    "mesh": Sweep("decimate.resolution", (512, 256, 128, 64, 32, 16, 8), {}),
    "texture": Sweep("texture.resolution", (1024, 512, 256, 128), {}),
    "paper": Sweep(RATE, FACTORS, PAPER_EXPORT),
    **{codec: Sweep(RATE, FACTORS, {**QUANTISED, "compress.video.codec": codec}) for codec in ("h264", "vp9", "av1")},
    "h264x32": Sweep(RATE, FACTORS, {**QUANTISED, "compress.video.codec": "h264", "decimate.resolution": 32}),
}
"""The paper's values (and 8 layers); then the series of bytes against accuracy."""


def changes(name: str, value: int, subject: str) -> dict[str, Any]:
    """Keys of a cell, under its subject; coarser levels of detail are not measured and left out.

    For textures finer than the subject's samples it is sampled as finely; its surfaces keep the vertices they had.

    Raises:
        UserError: if there is no such subject.
    """
    params = own_params(subject, {})
    entry = params["subjects"][subject]
    found = {**SWEEPS[name].fixed, SWEEPS[name].key: value, "compress.levels": []}
    given = {**params.get("sample", {}), **entry.get("sample", {})}.get("resolution", "auto")
    samples = LEAST if given == "auto" else given
    if name == "texture" and value > samples:
        found |= {"sample.resolution": value, "reconstruct.resolution": samples}
    if name in RATES:
        filmed = {"capture.frames": RATE_FRAMES} if entry["source"] == "actor" else {}
        found |= {"compress.video.target_psnr": None, **filmed}
    # A relative path leads nowhere from an experiment's folder.
    return found if entry["source"] == "actor" else {**found, "path": entry["path"]}


def queue_cell(name: str, value: int, subject: str) -> None:
    """`dvc exp run --queue`.

    Raises:
        UserError: with DVC's own words, if it refuses.
    """
    command = ["exp", "run", "--quiet", "--queue", "--name", f"{name}-{subject}-{value}"]
    for key, given in changes(name, value, subject).items():
        command += ["-S", f"++subjects.{subject}.{key}={json.dumps(given)}"]
    command = [sys.executable, "-m", "dvc", *command, f"evaluate@{subject}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        remedy = "forget experiments of this name with `dvc exp remove NAME`"
        raise UserError("`dvc exp run --queue` failed", found=done.stderr.strip()[-500:], remedy=remedy)


def row_of(run: Run) -> Row | None:
    """What became of an experiment; None if it is none of ours, or shows another subject beside its own."""
    named = re.fullmatch(rf"({'|'.join(SWEEPS)})-(.+)-(\d+)", run.experiment)
    if named is None or named[2] != run.subject:
        return None
    figures, renderer = dict(run.figures), ""
    if named[1] in AXES and not run.error:
        with TemporaryDirectory() as folder:
            files = DVCFileSystem(".", rev=run.revision)
            files.get(f"data/{run.subject}/asset", f"{folder}/asset", recursive=True)
            speed, renderer = drawing_speed(Path(folder) / "asset")
            figures |= {"pictures_a_second": speed} if speed else {}
    given = changes(named[1], int(named[3]), run.subject)
    return Row(
        sweep=named[1], value=int(named[3]), subject=run.subject, failure=run.error,
        params={key: value for key, value in given.items() if isinstance(value, int)},
        figures=figures, renderer=renderer, commit=commit_name(), machine=machine_name("cpu"), date=now(),
    )  # fmt: skip


def drawing_speed(asset: Path) -> tuple[float, str]:
    """Pictures a second of frame 0 at 1280 x 720 by the OpenGL renderer, the median of nine from in front, until its
    pixels are read back, and what drew them; 0 where there is no OpenGL."""
    taken = []
    try:
        with OpenGLRenderer(read_asset(asset)) as renderer:
            for eye in turntable(Eye(), 11, (30.0, 30.0)):
                camera = camera_of(eye, 1280, 720, 35.0)
                start = time.perf_counter()
                renderer.render(camera, 0)
                taken.append(time.perf_counter() - start)
            return round(float(1 / np.median(taken[2:])), 3), renderer.device
    except UserError as error:
        typer.echo(f"  not drawn: {error.message}")
        return 0.0, ""


app = typer.Typer(help=__doc__, add_completion=False, no_args_is_help=True)
Results = Annotated[Path, typer.Option(help="File that rows are added to.")]


@app.command()
def queue(
    what: Annotated[str, typer.Argument(help="layers, mesh, texture, rate, or one series of rate.")],
    subjects: Annotated[str, typer.Option(help="Comma-separated names in params.yaml.")] = "actor",
    values: Annotated[str, typer.Option(help="Comma-separated, in place of the paper's.")] = "",
) -> None:
    """Queue an experiment a cell."""
    with report_user_errors("sweeps"):
        if (names := list(RATES) if what == "rate" else [what])[0] not in SWEEPS:
            raise UserError("no such sweep", found=what, expected=", ".join([*SWEEPS, "rate"]))
        if not re.fullmatch(r"([1-9]\d*(,[1-9]\d*)*)?", values):
            raise UserError("not a list of whole numbers", place="--values", expected="such as 64,32,16", found=values)
        for subject in subjects.split(","):
            for name in names:
                for value in [int(part) for part in values.split(",")] if values else SWEEPS[name].values:
                    queue_cell(name, value, subject)
                    typer.echo(f"queued: {name}-{subject}-{value}")
        typer.echo("`dvc exp run --run-all` runs them, then `python -m bench.sweeps collect`")


@app.command()
def collect(results: Results = RESULTS) -> None:
    """Keep what has ended; a failed cell is a result."""
    with report_user_errors("sweeps"):
        store = Store(results, "rows", Row)
        runs, pending = runs_of(shown_experiments())
        for row in filter(None, map(row_of, runs)):
            store.add(row)
            said = f"failed: {row.failure}" if row.failure else f"{row.psnr:.2f} dB, {row.bytes} bytes"
            typer.echo(f"{row.sweep} {row.value}, {row.subject}: {said}")
        typer.echo(f"{pending} not ended yet")


@app.command()
def draw(results: Results = RESULTS) -> None:
    """Tables and charts of what has been measured."""
    with report_user_errors("sweeps"):
        kept = sorted(Store(results, "rows", Row).read(), key=lambda row: (row.sweep, row.subject, -row.value))
        rows = [row for row in kept if row.sweep in AXES]
        charts.sweeps(rows, IMAGES / "sweeps.png")
        runs = [Run(f"{r.sweep} {r.value}", r.subject, r.commit, r.params, r.figures, r.failure) for r in rows]
        write_runs(results.with_suffix(".csv"), runs)
        for sweep in AXES:
            subjects = sorted({row.subject for row in rows if row.sweep == sweep})
            text = "\n\n".join(f"`{subject}`:\n\n{sweep_table(rows, sweep, subject)}" for subject in subjects)
            start = f"<!-- {sweep}: written by bench/sweeps.py draw -->"
            replace_between(DOCUMENT, start, f"<!-- end of {sweep} -->", text)
        for film in sorted({row.subject for row in kept if row.sweep in RATES}):
            rates = [row for row in kept if row.sweep in RATES and row.subject == film and not row.failure]
            name = "rate_distortion" if film == "actor" else f"rate_distortion_{film}"
            charts.rate(rates, IMAGES / f"{name}.png", f"{film}, {RATE_FRAMES} frames")
            typer.echo(f"{film}:\n\n{rate_tables(rates)}")


if __name__ == "__main__":
    app()
