"""The chart of speed against accuracy: a picture for the README, and the same numbers for `dvc plots`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from bench.results import Measurement
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file, write_json
from facefolds_core.sweeps.frontier import frontier

COLOURS = {"fast": "#d1495b", "quick": "#00798c", "paper": "#5b5b66"}
SPARE_COLOURS = ("#edae49", "#66a182", "#8d6a9f")
FRONTIER_COLOUR = "#e9c46a"

RING: dict[str, Any] = {"ms": 8, "mfc": "none", "mec": "#333333", "mew": 0.9, "zorder": 4}

TITLE = "Held-out accuracy against training time, view-independent model"
FRONTIER = "Pareto frontier"
TIMES = {10: "10 s", 30: "30 s", 60: "1 min", 120: "2 min", 300: "5 min", 900: "15 min", 1800: "30 min", 3600: "1 h"}

NOTE = (
    "The paper gives no training time; its set-up asks for 500 000 iterations of 32 768 rays. It reports 25.49 dB "
    "(mean of 5 Multiface subjects,\n768 x 500, whole frame): other data, no comparison."
)


@dataclass(frozen=True)
class Metric:
    """A row of the chart.

    Attributes:
        name: field of `Scores`.
        label: on its axis.
        up: larger is better.
        height: of the row, against the others.
    """

    name: str
    label: str
    up: bool
    height: float


METRICS = (
    Metric("psnr", "PSNR, dB", True, 2.2),
    Metric("ssim", "SSIM", True, 1.0),
    Metric("lpips", "LPIPS", False, 1.0),
    Metric("st_lpips", "ST-LPIPS", False, 1.0),
)


def chart_data(measurements: Sequence[Measurement]) -> list[Measurement]:
    """Of each subject, preset and training time asked for the newest measurement, on the clock of the newest of all.

    By seconds; of equal ones the last. They may be of several commits, which `draw` names.
    """
    usable = sorted((m for m in measurements if m.scores is not None and not m.variant), key=lambda m: m.date)
    if not usable:
        return []
    clock = usable[-1].conditions.clock
    newest = {(m.subject, m.preset, m.budget): m for m in usable if m.conditions.clock == clock}
    series: dict[tuple[str, str], list[Measurement]] = defaultdict(list)
    for m in newest.values():
        series[m.subject, m.preset].append(m)
    chosen = []
    for points in series.values():
        chosen += sorted({m.iterations: m for m in points}.values(), key=lambda m: m.seconds)
    return chosen


def value(measurement: Measurement, metric: Metric) -> float | None:
    found: float | None = getattr(measurement.scores, metric.name)
    return found


def draw(measurements: Sequence[Measurement], path: Path) -> None:
    """Log time across, one row a metric, one column a subject, one line a preset, the frontier marked.

    Raises:
        UserError: if there is nothing to draw.
    """
    data = chart_data(measurements)
    if not data:
        raise UserError("nothing measured yet", remedy="run `make bench`")
    subjects = sorted({m.subject for m in data})
    metrics = [metric for metric in METRICS if any(value(m, metric) is not None for m in data)]
    heights = [metric.height for metric in metrics]
    seconds = [m.seconds for m in data]
    with matplotlib.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(1.2 + 4.4 * len(subjects), 1.6 + 1.45 * sum(heights)), dpi=150, layout="constrained")
        grid = figure.subplots(
            len(metrics), len(subjects), sharex=True, sharey="row", squeeze=False, height_ratios=heights
        )
        for column, subject in enumerate(subjects):
            own = [m for m in data if m.subject == subject]
            for row, metric in enumerate(metrics):
                _panel(grid[row, column], own, metric)
                if column == 0:
                    better = "higher" if metric.up else "lower"
                    grid[row, column].set_ylabel(f"{metric.label}\n({better} is better)")
            grid[-1, column].set_xlim(min(8.0, 0.9 * min(seconds)), 2.6 * max(seconds))
            grid[0, column].set_title(_title(subject, own), loc="left", fontsize=9, fontweight="bold")
            grid[-1, column].set_xlabel(_time_label(own))
        figure.suptitle(TITLE, fontsize=11, x=0.01, ha="left")
        lines = {str(line.get_label()): line for axes in grid[0] for line in axes.get_lines()}
        names = [FRONTIER, *sorted({m.preset for m in data}, key=_order)]
        figure.legend([lines[name] for name in names], names, loc="upper right", ncols=len(names), frameon=False)
        figure.supxlabel(f"{conditions_text(data)}\n{NOTE}", fontsize=6.5, x=0.01, ha="left", color="#555555")
        with atomic_file(path) as temporary:
            figure.savefig(temporary)


def _panel(axes: Axes, measurements: list[Measurement], metric: Metric) -> None:
    shown = [(m, v) for m in measurements if (v := value(m, metric)) is not None]
    best = [shown[i] for i in frontier([(m.seconds, v) for m, v in shown], metric.up)]
    axes.plot(
        [m.seconds for m, _ in best], [v for _, v in best], drawstyle="steps-post", color=FRONTIER_COLOUR, lw=5,
        alpha=0.55, solid_capstyle="butt", zorder=1, label=FRONTIER,
    )  # fmt: skip
    for preset in sorted({m.preset for m, _ in shown}, key=_order):
        line = [(m.seconds, v) for m, v in shown if m.preset == preset]
        axes.plot(*zip(*line, strict=True), "o-", color=colour(preset), lw=1.6, ms=4, zorder=3, label=preset)
        if metric is METRICS[0]:
            text: dict[str, Any] = {"color": colour(preset), "va": "center", "fontsize": 8, "fontweight": "bold"}
            axes.annotate(f"{preset} {line[-1][1]:.1f}", line[-1], (7, 0), textcoords="offset points", **text)
    axes.plot([m.seconds for m, _ in best], [v for _, v in best], "o", **RING)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(list(TIMES)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: TIMES.get(round(x), "")))
    axes.grid(color="#e6e6e6", lw=0.6, zorder=0)


def _title(subject: str, measurements: list[Measurement]) -> str:
    scores = measurements[0].scores
    return f"{subject} ({scores.region}, {scores.images} held-out images)" if scores else subject


def _time_label(measurements: list[Measurement]) -> str:
    conditions = measurements[0].conditions
    if conditions.clock == "wall":
        return "training time"
    return f"training time: processor time / {conditions.threads}"


def conditions_text(data: Sequence[Measurement]) -> str:
    """Clock, machine, commits and dates of what is drawn, one line."""
    newest = max(data, key=lambda m: m.date)
    clock = newest.conditions.clock
    meaning = (
        f"wall clock, {newest.conditions.threads} threads"
        if clock == "wall"
        else f"processor time / {newest.conditions.threads} (a machine shared with other work)"
    )
    dates = sorted({m.date[:10] for m in data})
    commits = ", ".join(
        f"{preset} {'/'.join(sorted({m.conditions.commit[:8] for m in data if m.preset == preset}))}"
        for preset in sorted({m.preset for m in data}, key=_order)
    )
    when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
    return f"{meaning}; {newest.conditions.machine}; {when}; commits: {commits}"


def colour(preset: str) -> str:
    return COLOURS.get(preset, SPARE_COLOURS[sum(preset.encode()) % len(SPARE_COLOURS)])


def _order(preset: str) -> tuple[int, str]:
    known = list(COLOURS)
    return (known.index(preset) if preset in known else len(known), preset)


def write_plot_data(measurements: Sequence[Measurement], path: Path) -> None:
    """The points of the chart as a JSON list for `dvc plots` (bench/dvc.yaml)."""
    data = chart_data(measurements)
    best: set[int] = set()
    for subject in {m.subject for m in data}:
        own = [i for i, m in enumerate(data) if m.subject == subject]
        points = [(data[i].seconds, value(data[i], METRICS[0]) or 0.0) for i in own]
        best |= {own[i] for i in frontier(points)}
    rows = [
        {
            "subject": m.subject,
            "preset": m.preset,
            "seconds": m.seconds,
            **{metric.name: v for metric in METRICS if (v := value(m, metric)) is not None},
            "frontier": i in best,
        }
        for i, m in enumerate(data)
    ]
    write_json(path, rows)
