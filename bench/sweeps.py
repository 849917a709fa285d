"""Sweeps over the parameters of an export, each cell an asset that DVC makes and `evaluate` scores.

python -m bench.sweeps layers          N = 12, 8, 4, 1: trains again
python -m bench.sweeps mesh            R^m = 512 ... 8, from the trained model
python -m bench.sweeps texture         R^t = 1024 ... 128, from the trained model
python -m bench.sweeps rate            the paper's export and ours at five rates, 60 frames: bytes against accuracy
python -m bench.sweeps draw            the tables of docs/research/ablations.md and the charts, from what is there

A cell is the subject's own configuration with a value changed, run by `dvc repro` in a copy of the project that shares
its cache: stages that cells share run once, and a cell that has not changed costs nothing. A cell that fails is kept as
such, and the others go on.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer

from bench import charts
from bench.results import Name, Row, Store, commit_name, machine_name, now
from bench.run import Project, Sections, own_params
from bench.tables import AXES, Point, rate_tables, replace_between, sweep_table
from facefolds_core.asset import read_asset
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import read_json, write_json
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering.camera_paths import Eye, camera_of, turntable
from facefolds_core.rendering.opengl import OpenGLRenderer
from facefolds_core.sweeps.table import Run, write_runs

RESULTS = Path("bench/results/sweeps.json")
RATE = Path("bench/results/rate_distortion.json")
IMAGES = Path("docs/images")
DOCUMENT = Path("docs/research/ablations.md")
WORK = Path("data/bench")
SIZES = (
    "vertices",
    "triangles",
    "mesh_bytes",
    "texture_bytes",
    "video_bits_per_second",
    "view_effects_bytes",
    "gpu_bytes",
)
"""Keys of `cost` in metrics.json that are about the asset."""


class Sweep(NamedTuple):
    """One ablation: a parameter, the paper's values (and 8 layers), and the export stages that a change reruns."""

    section: str
    key: str
    values: tuple[int, ...]
    timed: tuple[str, ...]


SWEEPS: dict[Name, Sweep] = {
    "layers": Sweep(
        "train", "layers", (12, 8, 4, 1), ("sample", "reconstruct", "decimate", "texture", "bake", "compress")
    ),
    "mesh": Sweep("decimate", "resolution", (512, 256, 128, 64, 32, 16, 8), ("decimate", "bake", "compress")),
    "texture": Sweep("texture", "resolution", (1024, 512, 256, 128), ("texture", "bake", "compress")),
}
RATE_FRAMES = 60
"""Of the actor: codecs are compared honestly only on sequences of real length."""
FACTORS = (17, 22, 27, 32, 38)
"""Constant rate factors, on x264's scale."""
PAPER_EXPORT: Sections = {
    "sample": {"resolution": 1024, "window": "full"},
    "reconstruct": {"method": "poisson", "resolution": 512},
    "decimate": {"resolution": 32, "uv": "nearest"},
    "texture": {"resolution": 1024},
    "bake": {"iterations": 0},
}
LOSSLESS = {"max_error_pixels": None, "quantization_bits": 0, "compression_level": 0}
QUANTISED = {"max_error_pixels": 0.2, "compression_level": 10}


def changes(name: Name, value: int, samples: int) -> dict[str, dict[str, Any]]:
    """Sections of a cell; coarser levels of detail are not measured and left out.

    Textures finer than the subject's `samples` would show no more: then it is sampled as finely, and its surfaces keep
    the vertices that they had.
    """
    sweep = SWEEPS[name]
    found: dict[str, dict[str, Any]] = {sweep.section: {sweep.key: value}, "compress": {"levels": []}}
    if name == "texture" and value > samples:
        found |= {"sample": {"resolution": value}, "reconstruct": {"resolution": samples}}
    return found


def run_cell(name: Name, value: int, subject: str, work: Path) -> Row:
    """One asset of a sweep, scored; a failure is a result."""
    project = Project(work / subject, subject)
    params = own_params(subject, {})
    samples = {**params["sample"], **params["subjects"][subject].get("sample", {})}.get("resolution", 512)
    sections = changes(name, value, samples)
    given = {f"{section}.{k}": v for section, keys in sections.items() for k, v in keys.items()}
    identity: dict[str, Any] = {
        "sweep": name, "subject": subject, "value": value, "commit": commit_name(), "date": now(),
        "params": {key: v for key, v in given.items() if isinstance(v, int)},
    }  # fmt: skip
    try:
        project.write(own_params(subject, sections))
        project.repro("evaluate")
        metrics = read_json(project.folders.metrics)
        device = metrics["cost"]["device"]
        timed = [read_json(project.folders.timing(stage))["seconds"] for stage in SWEEPS[name].timed]
        trained = metrics["cost"]["train_seconds"] if name == "layers" else 0.0
        return Row(
            **identity, machine=machine_name(device), scores=metrics["asset"], **drawing_speed(project.folders),
            cost={key: metrics["cost"][key] for key in SIZES}, train_seconds=trained, export_seconds=sum(timed),
        )  # fmt: skip
    except UserError as error:
        return Row(**identity, machine=machine_name(""), failure=error.message)


def drawing_speed(folders: SubjectFolders) -> dict[str, Any]:
    """Pictures a second of frame 0 at 1280 x 720 by the OpenGL renderer, the median of nine from in front, until its
    pixels are read back; nothing where there is no OpenGL."""
    taken = []
    try:
        with OpenGLRenderer(read_asset(folders.asset)) as renderer:
            for eye in turntable(Eye(), 11, 30.0):
                camera = camera_of(eye, 1280, 720, 35.0)
                start = time.perf_counter()
                renderer.render(camera, 0)
                taken.append(time.perf_counter() - start)
            return {"pictures_a_second": round(float(1 / np.median(taken[2:])), 3), "renderer": renderer.device}
    except UserError as error:
        typer.echo(f"  not drawn: {error.message}")
        return {}


def rate_series() -> Iterator[tuple[str, Sections]]:
    """Name and sections of each series of bytes against accuracy, but for its rates.

    `paper`: the whole hemisphere, Poisson, the nearest sample's texture coordinates, Draco without loss. All go through
    the same writer, which crops layers and leaves out what shows nothing: that flatters the paper's.
    """
    yield "paper", {**PAPER_EXPORT, "compress": {"mesh": LOSSLESS, "video": {"codec": "h264", "preset": "medium"}}}
    for codec in ("h264", "vp9", "av1"):
        yield f"ours, {codec}", {"compress": {"mesh": QUANTISED, "video": {"codec": codec}}}
    video = {"codec": "h264"}
    yield "ours32, h264", {"decimate": {"resolution": 32}, "compress": {"mesh": QUANTISED, "video": video}}


def measure_rates(subject: str, work: Path, frames: int) -> list[Point]:
    """A point for each series and factor: bytes, and PSNR on the held-out cameras (of the subject, where known)."""
    project, found = Project(work / f"{subject}-rate", subject), []
    for name, sections in rate_series():
        for factor in FACTORS:
            own = sections["compress"]
            video = {**own["video"], "crf": factor, "target_psnr": None}
            compress = {"compress": {**own, "video": video, "levels": []}}
            film = {"capture": {"frames": frames}} if subject == "actor" else {}
            project.write(own_params(subject, {**sections, **compress, **film}))
            project.repro("evaluate")
            metrics = read_json(project.folders.metrics)
            sizes = {"mesh_bytes": metrics["cost"]["mesh_bytes"], "video_bytes": metrics["cost"]["texture_bytes"]}
            psnr = metrics["asset"]["psnr_subject"] or metrics["asset"]["psnr"]
            found.append({"series": name, "crf": factor, **sizes, "psnr": psnr, "bytes": sum(sizes.values())})
            typer.echo(f"{name}, crf {factor}: {found[-1]['bytes']} bytes, {psnr:.3f} dB")
    return found


def as_run(row: Row) -> Run:
    """A row as `facefolds recommend` reads it; what is not under `params` is as the subject has it."""
    figures = {name: value for name, value in row.scores.items() if value is not None}
    figures |= {name: float(value) for name, value in row.cost.items()}
    figures |= {"pictures_a_second": row.pictures_a_second} if row.pictures_a_second else {}
    if not row.failure:
        figures["bytes"] = float(row.bytes + row.cost["view_effects_bytes"])
    return Run(f"{row.sweep} {row.value}", row.subject, row.commit, row.params, figures, row.failure)


def draw(results: Path, document: Path, images: Path) -> None:
    """Tables, charts, and the table for `facefolds recommend`, from what has been measured."""
    rows = sorted(Store(results, "rows", Row).read(), key=lambda row: (row.sweep, row.subject, -row.value))
    charts.sweeps(rows, images / "sweeps.png")
    write_runs(results.with_suffix(".csv"), [as_run(row) for row in rows])
    for sweep in AXES:
        subjects = sorted({row.subject for row in rows if row.sweep == sweep})
        text = "\n\n".join(f"`{subject}`:\n\n{sweep_table(rows, sweep, subject)}" for subject in subjects)
        replace_between(
            document, f"<!-- {sweep}: written by bench/sweeps.py draw -->", f"<!-- end of {sweep} -->", text
        )


def main(
    what: Annotated[str, typer.Argument(help="layers, mesh, texture, rate or draw.")],
    subjects: Annotated[str, typer.Option(help="Comma-separated names in params.yaml.")] = "actor",
    values: Annotated[str, typer.Option(help="Comma-separated, in place of the paper's.")] = "",
    work: Annotated[Path, typer.Option(help="Folder for the cells.")] = WORK,
    results: Annotated[Path, typer.Option(help="File that the rows are added to.")] = RESULTS,
) -> None:
    """Measure the paper's ablations on our own subjects, or bytes against accuracy; or draw what is there."""
    with report_user_errors("sweeps"):
        if what == "draw":
            draw(results, DOCUMENT, IMAGES)
        elif what == "rate":
            points = measure_rates(subjects, work, RATE_FRAMES)
            write_json(RATE, points)
            charts.rate(points, IMAGES / "rate_distortion.png", f"{subjects}, {RATE_FRAMES} frames")
            typer.echo(rate_tables(points))
        elif what in SWEEPS:
            run_sweep(what, subjects.split(","), values, work, results)
        else:
            raise UserError("no such sweep", found=what, expected=", ".join([*SWEEPS, "rate", "draw"]))


def run_sweep(what: str, subjects: list[str], values: str, work: Path, results: Path) -> None:
    """Every cell of a sweep, each kept as soon as it is there.

    Raises:
        UserError: if values are none, or cells failed.
    """
    (name,) = (sweep for sweep in SWEEPS if sweep == what)
    try:
        chosen = [int(part) for part in values.split(",")] if values else list(SWEEPS[name].values)
    except ValueError:
        chosen = [0]
    if min(chosen) < 1:
        raise UserError("not a list of whole numbers", place="--values", expected="such as 64,32,16", found=values)
    failed, store = [], Store(results, "rows", Row)
    for subject in subjects:
        for value in chosen:
            row = run_cell(name, value, subject, work)
            store.add(row)
            psnr = row.psnr
            title = f"{name} {value}, {subject}"
            typer.echo(f"{title}: {f'failed: {row.failure}' if psnr is None else f'{psnr:.2f} dB, {row.bytes} bytes'}")
            failed += [f"{title}: {row.failure}"] if row.failure else []
    if failed:
        raise UserError("cells that failed:\n" + "\n".join(failed))


if __name__ == "__main__":
    typer.run(main)
