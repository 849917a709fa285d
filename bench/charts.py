"""All charts, by matplotlib: speed against accuracy, hazards, sweeps, bytes against accuracy, steps of the export."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import accumulate
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import EngFormatter, FixedLocator, FuncFormatter, LogLocator, NullLocator

from bench.hazard_rows import CLEAN, ROWS, loss_of
from bench.results import Cell, Measurement, Row
from bench.tables import PAPER, RATES, cell_text
from facefolds_core.errors import UserError
from facefolds_core.files.writing import atomic_file

STYLE: Any = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}
FRONTIER = "Pareto frontier"
WIDE: dict[str, Any] = {"color": "#e9c46a", "lw": 5, "alpha": 0.55, "drawstyle": "steps-post", "solid_capstyle": "butt"}
RING: dict[str, Any] = {"ms": 8, "mfc": "none", "mec": "#333333", "mew": 0.9, "zorder": 4}
TITLE: dict[str, Any] = {"fontsize": 11, "x": 0.01, "ha": "left"}
NOTE: dict[str, Any] = {"fontsize": 6.5, "x": 0.01, "ha": "left", "color": "#555555"}


@contextmanager
def figure_of(path: Path, width: float, height: float, dpi: int = 150) -> Iterator[Figure]:
    """A figure that is written to `path` at the end."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        yield figure
        with atomic_file(path) as temporary:
            figure.savefig(temporary, dpi=dpi, metadata={"Software": None})


def _legend(figure: Figure, names: Sequence[str], **options: Any) -> None:
    """The lines of all panels, each name once."""
    lines = {str(line.get_label()): line for axes in figure.axes for line in axes.get_lines()}
    there = [name for name in names if name in lines]
    figure.legend([lines[n] for n in there], there, loc="upper right", ncols=len(there), frameon=False, **options)


def _front(axes: Axes, points: Sequence[tuple[float, float]], up: bool = True, falling: bool = False) -> None:
    """The points that no other one beats: of smaller cost (larger, if `falling`) and a better value."""
    way = sorted(points, key=lambda point: (-point[0] if falling else point[0], -point[1] if up else point[1]))
    bests = list(accumulate((y for _, y in way), max if up else min))
    best = [point for i, point in enumerate(way) if i == 0 or bests[i] != bests[i - 1]]
    axes.plot([x for x, _ in best], [y for _, y in best], zorder=1, label=FRONTIER, **WIDE)
    axes.plot([x for x, _ in best], [y for _, y in best], "o", **RING)
    axes.grid(color="#e6e6e6", lw=0.6, zorder=0)


PRESET_COLOURS = {"fast": "#d1495b", "quick": "#00798c", "paper": "#5b5b66"}
TIMES = {10: "10 s", 30: "30 s", 60: "1 min", 120: "2 min", 300: "5 min", 900: "15 min", 1800: "30 min", 3600: "1 h"}
METRICS = {"psnr": "PSNR, dB", "ssim": "SSIM", "lpips": "LPIPS", "st_lpips": "ST-LPIPS"}
"""Name in `Scores` -> on its axis. Of the first two, larger is better."""
SPEED_NOTE = (
    "The paper gives no training time; its set-up asks for 500 000 iterations of 32 768 rays. It reports 25.49 dB "
    "(mean of 5 Multiface subjects,\n768 x 500, whole frame): other data, no comparison."
)


def newest(measurements: Sequence[Measurement]) -> list[Measurement]:
    """Of each subject, preset and training time asked for the newest measurement, on the clock of the newest of all;
    by seconds, of equal iterations the last. They may be of several commits, which the chart names."""
    usable = sorted((m for m in measurements if m.scores), key=lambda m: m.date)
    same = [m for m in usable if m.conditions.clock == usable[-1].conditions.clock]
    last = {(m.subject, m.preset, m.budget or m.iterations): m for m in same}
    one = {(m.subject, m.preset, m.iterations): m for m in last.values()}
    return sorted(one.values(), key=lambda m: (m.subject, m.preset, m.seconds))


def speed(measurements: Sequence[Measurement], path: Path) -> None:
    """Log time across, one row a metric, one column a subject, one line a preset, the frontier marked.

    Raises:
        UserError: if there is nothing to draw.
    """
    data = newest(measurements)
    if not data:
        raise UserError("nothing measured yet", remedy="run `make bench`")
    subjects, seconds = sorted({m.subject for m in data}), [m.seconds for m in data]
    metrics = [name for name in METRICS if any(getattr(m.scores, name) is not None for m in data)]
    heights = [2.2 if name == "psnr" else 1.0 for name in metrics]
    with figure_of(path, 1.2 + 4.4 * len(subjects), 1.6 + 1.45 * sum(heights)) as figure:
        shape: Any = {"sharex": True, "sharey": "row", "squeeze": False, "height_ratios": heights}
        grid = figure.subplots(len(metrics), len(subjects), **shape)
        for column, subject in enumerate(subjects):
            own = [m for m in data if m.subject == subject]
            for row, name in enumerate(metrics):
                _speed_panel(grid[row, column], own, name)
                better = "lower" if "lpips" in name else "higher"
                grid[row, 0].set_ylabel(f"{METRICS[name]}\n({better} is better)")
            scores, at = own[0].scores, own[0].conditions
            title = f"{subject} ({scores.region}, {scores.images} held-out images)" if scores else subject
            grid[0, column].set_title(title, loc="left", fontsize=9, fontweight="bold")
            label = "training time" if at.clock == "wall" else f"training time: processor time / {at.threads}"
            grid[-1, column].set(xlim=(min(8.0, 0.9 * min(seconds)), 2.6 * max(seconds)), xlabel=label)
        figure.suptitle("Held-out accuracy against training time: models as they ship", **TITLE)
        _legend(figure, [FRONTIER, *dict.fromkeys([*PRESET_COLOURS, *(m.preset for m in data)])])
        figure.supxlabel(f"{conditions_text(data)}\n{SPEED_NOTE}", **NOTE)


def _speed_panel(axes: Axes, measurements: Sequence[Measurement], name: str) -> None:
    lines: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for m in measurements:
        if (value := getattr(m.scores, name)) is not None:
            lines[m.preset].append((m.seconds, value))
    _front(axes, [point for line in lines.values() for point in line], "lpips" not in name)
    for preset, line in lines.items():
        colour = PRESET_COLOURS.get(preset, "#edae49")
        axes.plot(*zip(*line, strict=True), "o-", color=colour, lw=1.6, ms=4, zorder=3, label=preset)
        if name == "psnr":
            text: dict[str, Any] = {"color": colour, "va": "center", "fontsize": 8, "fontweight": "bold"}
            axes.annotate(f"{preset} {line[-1][1]:.1f}", line[-1], (7, 0), textcoords="offset points", **text)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(list(TIMES)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: TIMES.get(round(x), "")))


def conditions_text(data: Sequence[Measurement]) -> str:
    """Clock, machine, commits and dates of what is drawn, one line."""
    at = max(data, key=lambda m: m.date).conditions
    shared = f"processor time / {at.threads} (a machine shared with other work)"
    clock = shared if at.clock == "processor" else f"wall clock, {at.threads} threads"
    commits: dict[str, set[str]] = defaultdict(set)
    for m in data:
        commits[m.preset].add(m.conditions.commit[:8])
    made = ", ".join(f"{preset} {'/'.join(sorted(names))}" for preset, names in commits.items())
    return f"{clock}; {at.machine}; {_dates([m.date for m in data])}; commits: {made}"


def _dates(dates: Sequence[str]) -> str:
    days = sorted({date[:10] for date in dates})
    return days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"


LOSSES = LinearSegmentedColormap.from_list(
    "loss", [(0.0, "#4f9d8b"), (0.5, "#f4f1e8"), (0.64, "#f2b872"), (0.82, "#d1495b"), (1.0, "#5c1a33")]
)
NORM = TwoSlopeNorm(0.0, -2.0, 8.0)
"""dB lost -> colour."""


def hazards(cells: Sequence[Cell], path: Path) -> None:
    """Rows are hazards, columns the strengths of each preset; each field says what is lost, and at what strength."""
    presets = sorted({c.preset for c in cells})
    with figure_of(path, 2.6 + 3.1 * len(presets), 1.3 + 0.36 * len(ROWS), dpi=110) as figure:
        axes = figure.subplots()
        for block, preset in enumerate(presets):
            own = [c for c in cells if c.preset == preset]
            for row, hazard in enumerate(ROWS):
                for place, strength in enumerate(hazard.strengths):
                    loss = loss_of(own, hazard, strength)
                    value = loss.mean if loss else None
                    grey = "#8a8a94" if loss else "#f4f4f6"
                    colour = grey if value is None else LOSSES(float(NORM(min(value, 8.0))))
                    corner, ink = (3.15 * block + place, row), "white" if (value or 0) > 3.5 else "#222222"
                    axes.add_patch(Rectangle(corner, 1, 1, facecolor=colour, edgecolor="white", lw=1.5))
                    for down, size, text in ((0.4, 9, cell_text(loss)), (0.8, 6, hazard.label(strength))):
                        at = corner[0] + 0.5, row + down
                        axes.text(*at, text, ha="center", va="center", fontsize=size, color=ink)
            seeds = len({c.seed for c in own if c.hazard != CLEAN.key})
            text = f"{preset} ({seeds} seed{'s' if seeds != 1 else ''})"
            axes.text(3.15 * block + 1.5, -0.95, text, ha="center", fontsize=10, weight="bold")
        axes.set(xlim=(0, 3.15 * (len(presets) - 1) + 3), ylim=(len(ROWS), 0), yticks=np.arange(len(ROWS)) + 0.5)
        axes.set_yticklabels([hazard.title for hazard in ROWS], fontsize=9)
        axes.set_xticks([3.15 * b + p + 0.5 for b in range(len(presets)) for p in range(3)])
        axes.set_xticklabels(["weak", "middle", "strong"] * len(presets), fontsize=8)
        axes.xaxis.tick_top()
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_title("dB lost on clean held-out views, against the clean case", fontsize=11, pad=42)
        axes.set_xlabel("* a seed did not converge or failed;  failed: none ended;  -: not measured", fontsize=8)


SWEEPS = {
    "layers": ("layers N", "#5b3a8e", (0, -11)),
    "mesh": ("mesh resolution R^m", "#d1495b", (0, 6)),
    "texture": ("texture resolution R^t", "#00798c", (6, -9)),
}
"""Sweep -> its name, its colour, and where its values stand beside their points."""
PAPER_NAME = "the paper's rows (other data)"
COSTS = {
    "bytes": "bytes of meshes and texture video",
    "triangles": "triangles of all layers",
    "pictures_a_second": "pictures a second at 1280 x 720 (fewer to the right)",
}
SWEEP_NOTE = (
    "Ours: the exported asset on held-out cameras, subject only; one value of the subject's own configuration changed "
    "at a time. Grey: the paper's\npublished ablations, one a line (Multiface at 768 x 500, whole frame, 60 frames): "
    "the shape of the curves compares, not their height."
)


def own_spots(rows: Sequence[Row], cost: str) -> dict[str, list[tuple[int, float, float]]]:
    """Sweep -> (value, cost, PSNR) of a subject's measured cells, by value."""
    found: dict[str, list[tuple[int, float, float]]] = {sweep: [] for sweep in SWEEPS}
    for row in sorted(rows, key=lambda row: row.value):
        if x := row.bytes if cost == "bytes" else row.figures.get(cost):
            found[row.sweep].append((row.value, x, row.psnr))
    return found


def sweeps(rows: Sequence[Row], path: Path) -> None:
    """One row of panels a subject, one column a cost; cost across (log), PSNR upwards.

    Raises:
        UserError: if there is nothing to draw.
    """
    measured = [row for row in rows if not row.failure]
    subjects = sorted({row.subject for row in measured})
    if not subjects:
        raise UserError("nothing measured yet", remedy="run `python -m bench.sweeps queue mesh`")
    with figure_of(path, 14.5, 1.3 + 3.7 * len(subjects)) as figure:
        grid = figure.subplots(len(subjects), len(COSTS), sharex="col", sharey="row", squeeze=False)
        for i, subject in enumerate(subjects):
            for j, (cost, label) in enumerate(COSTS.items()):
                _sweep_panel(grid[i, j], cost, own_spots([r for r in measured if r.subject == subject], cost))
                grid[-1, j].set_xlabel(label)
            grid[i, 0].set_ylabel("PSNR, dB (higher is better)")
            grid[i, 0].set_title(subject, loc="left", fontsize=9, fontweight="bold")
            drawn = f"drawn by {', '.join(sorted({row.renderer for row in measured if row.renderer}))}"[:70]
            grid[i, -1].set_title(drawn, loc="right", fontsize=6.5, color="#555555")
        figure.suptitle("Held-out quality against cost", **TITLE)
        _legend(figure, [FRONTIER, *(name for name, _, _ in SWEEPS.values()), PAPER_NAME], fontsize=7.5)
        at = f"measured {_dates([r.date for r in measured])}, commit {', '.join(sorted({r.commit for r in measured}))}"
        figure.supxlabel(f"{SWEEP_NOTE}\n{at}", **NOTE)


def _sweep_panel(axes: Axes, cost: str, own: Mapping[str, Sequence[tuple[int, float, float]]]) -> None:
    text: dict[str, Any] = {"fontsize": 6.5, "ha": "center", "textcoords": "offset points"}
    grey: dict[str, Any] = {"color": "#a3a3ad", "lw": 0.8, "ms": 3, "label": PAPER_NAME}
    for sweep, points in PAPER.items() if cost != "pictures_a_second" else ():
        whole = cost == "bytes"
        xs = [p["disk_bytes"] + p["other_bytes"] if whole else p["triangles"] for p in reversed(points)]
        line = list(zip(xs, [p["psnr"] for p in reversed(points)], strict=True))
        axes.plot(*zip(*line, strict=True), "D-", **grey)
        axes.annotate(f"{sweep} {points[-1]['value']}", line[0], (0, -10), color="#a3a3ad", **text)
    _front(axes, [spot[1:] for line in own.values() for spot in line], falling=cost == "pictures_a_second")
    for sweep, (name, colour, offset) in SWEEPS.items():
        if own[sweep]:
            _, costs, heights = zip(*own[sweep], strict=True)
            axes.plot(costs, heights, "o-", color=colour, lw=1.4, ms=4, label=name)
        for value, x, psnr in own[sweep]:
            axes.annotate(str(value), (x, psnr), offset, color=colour, **text)
    axes.set_xscale("log")
    if cost == "pictures_a_second":
        axes.set_xlim(*sorted(axes.get_xlim(), reverse=True))  # shared by a column: to invert would undo itself
    axes.xaxis.set_major_formatter(EngFormatter(sep=" "))


def rate(rows: Sequence[Row], path: Path, title: str) -> None:
    """Bytes across (log), PSNR upwards, a line a series."""
    with figure_of(path, 7, 4.5, dpi=120) as figure:
        axes = figure.subplots()
        for name in [name for name in RATES if any(row.sweep == name for row in rows)]:
            line = sorted((row.bytes / 1000, row.psnr) for row in rows if row.sweep == name)
            axes.plot(*zip(*line, strict=True), "o-", label=RATES[name])
        axes.set(xscale="log", xlabel="kB, meshes and video", ylabel="PSNR on held-out cameras, dB", title=title)
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter("{x:g}")
        axes.grid(True, alpha=0.3)
        axes.legend(loc="lower right")
