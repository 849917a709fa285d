"""Quality against bytes and against triangles: a picture of the sweeps, and the same points for `dvc plots`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from bench.chart import FRONTIER, FRONTIER_COLOUR, RING
from bench.paper import PAPER, total_bytes
from bench.sweep_rows import Name, Row
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file, write_json
from facefolds_core.sweeps.frontier import frontier

COLOURS = {"layers": "#5b3a8e", "mesh": "#d1495b", "texture": "#00798c"}
NAMES = {"layers": "layers N", "mesh": "mesh resolution R^m", "texture": "texture resolution R^t"}
PAPER_COLOUR = "#a3a3ad"
PAPER_NAME = "the paper's rows (other data)"
AXES = {
    "bytes": "bytes of meshes and texture video",
    "triangles": "triangles of all layers",
    "pictures_a_second": "pictures a second at 1280 x 720 (fewer to the right)",
}
FALLING = "pictures_a_second"
"""The axis on which more is better: it runs from right to left, so that what is cheap stands at the left on all."""
NOTE = (
    "Ours: the exported asset on held-out cameras, subject only; one value of the subject's own configuration changed "
    "at a time. Grey: the paper's\npublished ablations, one a line (Multiface at 768 x 500, whole frame, 60 frames): "
    "the shape of the curves compares, not their height."
)


@dataclass(frozen=True)
class Point:
    """One cell on one chart."""

    sweep: Name
    value: int
    x: float
    psnr: float


def own_points(rows: Sequence[Row], subject: str, axis: str) -> list[Point]:
    """A subject's measured cells."""
    found = []
    for row in rows:
        psnr, x = row.score("psnr"), _place(row, axis)
        if row.subject == subject and psnr is not None and x:
            found.append(Point(row.sweep, row.value, x, psnr))
    return found


def _place(row: Row, axis: str) -> float:
    """0 where it was not measured."""
    if row.failure:
        return 0.0
    if axis == "bytes":
        return row.bytes
    return row.cost["triangles"] if axis == "triangles" else row.pictures_a_second


def paper_points(axis: str) -> list[Point]:
    """The paper's cells; it gives no pictures a second for them."""
    if axis == FALLING:
        return []
    found: list[Point] = []
    sweeps: tuple[Name, ...] = ("layers", "mesh", "texture")
    for sweep in sweeps:
        for p in PAPER[sweep]:
            found.append(Point(sweep, p.value, total_bytes(sweep, p) if axis == "bytes" else p.triangles, p.psnr))
    return found


def best(points: Sequence[Point], axis: str) -> list[int]:
    sign = -1 if axis == FALLING else 1
    return frontier([(sign * p.x, p.psnr) for p in points])


def draw(rows: Sequence[Row], path: Path) -> None:
    """One row of panels a subject, one column an axis; cost across (log), PSNR upwards.

    Raises:
        UserError: if there is nothing to draw.
    """
    subjects = sorted({row.subject for row in rows if not row.failure})
    if not subjects:
        raise UserError("nothing measured yet", remedy="run `python -m bench.sweeps mesh`, `texture` or `layers`")
    with matplotlib.rc_context(
        {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "0"}
    ):
        figure = Figure(figsize=(14.5, 1.3 + 3.7 * len(subjects)), dpi=150, layout="constrained")
        grid = figure.subplots(len(subjects), len(AXES), sharex="col", sharey="row", squeeze=False)
        for i, subject in enumerate(subjects):
            for j, axis in enumerate(AXES):
                _panel(grid[i, j], axis, own_points(rows, subject, axis), paper_points(axis))
                grid[-1, j].set_xlabel(AXES[axis])
            grid[i, 0].set_ylabel("PSNR, dB (higher is better)")
            for name in {row.renderer for row in rows if row.renderer}:
                grid[i, -1].set_title(f"drawn by {name}"[:70], loc="right", fontsize=6.5, color="#555555")
            grid[i, 0].set_title(subject, loc="left", fontsize=9, fontweight="bold")
        figure.suptitle("Held-out quality against cost", fontsize=11, x=0.01, ha="left")
        lines = {str(line.get_label()): line for axes in grid.flat for line in axes.get_lines()}
        names = [name for name in (FRONTIER, *NAMES.values(), PAPER_NAME) if name in lines]
        figure.legend(
            [lines[n] for n in names], names, loc="upper right", ncols=len(names), frameon=False, fontsize=7.5
        )
        figure.supxlabel(f"{NOTE}\n{origin(rows)}", fontsize=6.5, x=0.01, ha="left", color="#555555")
        with atomic_file(path) as temporary:
            figure.savefig(temporary, metadata={"Date": None} if path.suffix == ".svg" else None)


def _panel(axes: Axes, axis: str, own: list[Point], paper: list[Point]) -> None:
    for sweep in COLOURS:
        line = sorted((p for p in paper if p.sweep == sweep), key=lambda p: p.value)
        if not line:
            continue
        axes.plot([p.x for p in line], [p.psnr for p in line], "D-", color=PAPER_COLOUR, lw=0.8, ms=3, label=PAPER_NAME)
        text: dict[str, Any] = {"color": PAPER_COLOUR, "fontsize": 6.5, "textcoords": "offset points", "ha": "center"}
        axes.annotate(f"{sweep} {line[0].value}", (line[0].x, line[0].psnr), (0, -10), **text)
    front = [own[i] for i in best(own, axis)]
    steps: dict[str, Any] = {"drawstyle": "steps-post", "solid_capstyle": "butt"}
    axes.plot(
        [p.x for p in front], [p.psnr for p in front], color=FRONTIER_COLOUR, lw=5, alpha=0.55, label=FRONTIER, **steps
    )
    for sweep, colour in COLOURS.items():
        line = sorted((p for p in own if p.sweep == sweep), key=lambda p: p.value)
        if not line:
            continue
        axes.plot([p.x for p in line], [p.psnr for p in line], "o-", color=colour, lw=1.4, ms=4, label=NAMES[sweep])
        for p in line:
            offset = {"layers": (0, -11), "mesh": (0, 6), "texture": (6, -9)}[sweep]
            text = {"color": colour, "fontsize": 6.5, "ha": "center", "textcoords": "offset points"}
            axes.annotate(str(p.value), (p.x, p.psnr), offset, **text)
    axes.plot([p.x for p in front], [p.psnr for p in front], "o", **RING)
    axes.set_xscale("log")
    if axis == FALLING:
        axes.set_xlim(*sorted(axes.get_xlim(), reverse=True))  # shared by a column: to invert would undo itself
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: _short(x)))
    axes.grid(color="#e6e6e6", lw=0.6, zorder=0)


def _short(count: float) -> str:
    """1e6 -> "1 M"."""
    for unit, factor in (("M", 1e6), ("k", 1e3)):
        if count >= factor:
            return f"{count / factor:g} {unit}"
    return f"{count:g}"


def origin(rows: Sequence[Row]) -> str:
    """Commits and dates of what is drawn."""
    measured = [row for row in rows if not row.failure]
    commits = ", ".join(sorted({row.commit for row in measured}))
    dates = sorted({row.date[:10] for row in measured})
    when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
    return f"measured {when}, commit {commits}"


def write_plot_data(rows: Sequence[Row], folder: Path) -> None:
    """sweeps_<axis>.json: the points as a JSON list for `dvc plots` (bench/dvc.yaml)."""
    for axis in AXES:
        found: list[dict[str, Any]] = []
        for subject in sorted({row.subject for row in rows if not row.failure}):
            own = own_points(rows, subject, axis)
            front = set(best(own, axis))
            found += [_entry(subject, p.sweep, p, axis, i in front) for i, p in enumerate(own)]
            found += [_entry(subject, f"paper: {p.sweep}", p, axis, False) for p in paper_points(axis)]
        write_json(folder / f"sweeps_{axis}.json", found)


def _entry(subject: str, series: str, point: Point, axis: str, front: bool) -> dict[str, Any]:
    return {
        "subject": subject,
        "series": series,
        "value": point.value,
        axis: point.x,
        "psnr": point.psnr,
        "frontier": front,
    }
