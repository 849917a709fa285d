"""The heat map of the matrix, and pictures of its worst cells."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from bench.stress_cells import CLEAN, Cell, strip_path
from bench.stress_tables import ROWS, cell_text, loss_of
from facefolds_core.files import atomic_file

Colour = tuple[float, float, float, float]

DARKEST = 8.0
"""dB at which the colour is darkest."""

COLOURS = LinearSegmentedColormap.from_list(
    "loss", [(0.0, "#4f9d8b"), (0.5, "#f4f1e8"), (0.64, "#f2b872"), (0.82, "#d1495b"), (1.0, "#5c1a33")]
)
GREY, EMPTY = "#8a8a94", "#f4f4f6"
NAMES = ("weak", "middle", "strong")
WORST = 8
LEAST = 0.5
"""dB; rows that lose less are not shown."""


def draw_heat_map(cells: Sequence[Cell], presets: Sequence[str], path: Path) -> None:
    """Rows are hazards, columns the strengths of each preset; each field says what is lost, and at what strength."""
    figure = Figure(figsize=(2.6 + 3.1 * len(presets), 1.3 + 0.36 * len(ROWS)), layout="constrained")
    axes = figure.subplots()
    norm = TwoSlopeNorm(0.0, -2.0, DARKEST)
    for row, hazard in enumerate(ROWS):
        for block, preset in enumerate(presets):
            for place, strength in enumerate(hazard.strengths):
                loss = loss_of(cells, hazard, strength, preset)
                value = None if loss is None else loss.mean
                colour = to_rgba(GREY if loss is not None and value is None else EMPTY)
                if value is not None:
                    colour = COLOURS(float(norm(min(value, DARKEST))))
                _field(axes, 3.15 * block + place, row, colour, cell_text(loss), hazard.label(strength), value)
    ends = 3.15 * (len(presets) - 1) + 3
    axes.set(xlim=(0, ends), ylim=(len(ROWS), 0), yticks=np.arange(len(ROWS)) + 0.5)
    axes.set_yticklabels([hazard.title for hazard in ROWS], fontsize=9)
    axes.set_xticks([3.15 * b + p + 0.5 for b in range(len(presets)) for p in range(3)])
    axes.set_xticklabels([f"{name}" for _ in presets for name in NAMES], fontsize=8)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    for block, preset in enumerate(presets):
        seeds = len({c.seed for c in cells if c.preset == preset and c.hazard != CLEAN.key})
        text = f"{preset} ({seeds} seed{'s' if seeds != 1 else ''})"
        axes.text(3.15 * block + 1.5, -0.95, text, ha="center", fontsize=10, weight="bold")
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_title("dB lost on clean held-out views, against the clean case", fontsize=11, pad=42)
    axes.set_xlabel("* a seed did not converge or failed;  failed: none ended;  -: not measured", fontsize=8)
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")


def _field(axes: Axes, x: float, y: float, colour: Colour, text: str, label: str, value: float | None) -> None:
    axes.add_patch(Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="white", lw=1.5))
    ink = "white" if value is not None and value > 3.5 else "#222222"
    axes.text(x + 0.5, y + 0.4, text, ha="center", va="center", fontsize=9, color=ink)
    axes.text(x + 0.5, y + 0.8, label, ha="center", va="center", fontsize=6, color=ink)


def draw_worst(cells: Sequence[Cell], preset: str, pictures: Path, path: Path) -> None:
    """Truth, clean case and hazard, of the rows that lose most at seed 0, each at the strongest strength that was
    measured; the worst view inside the rig."""
    clean = next((c for c in cells if c.key == (CLEAN.key, 0.0, preset, 0)), None)
    found = {c.key: c for c in cells if c.views and strip_path(pictures, c).exists()}
    if clean is None or clean.inner is None or clean.key not in found:
        return
    ready, titles = [], {}
    for hazard in ROWS:
        measured = [c for s in hazard.strengths if (c := found.get((hazard.key, s, preset, 0)))]
        if measured and clean.inner - (measured[-1].inner or 0.0) > LEAST:
            ready.append(measured[-1])
            titles[hazard.key] = f"{hazard.title}, {hazard.label(measured[-1].strength)}"
    if not ready:
        return
    ready.sort(key=lambda c: c.inner or 0.0)
    columns = 2
    rows = -(-min(WORST, len(ready)) // columns)
    figure = Figure(figsize=(8.4, 2.45 * rows), layout="constrained")
    fields = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in fields[len(ready) :]:
        axes.set_visible(False)
    for axes, cell in zip(fields, ready[:WORST], strict=False):
        inner = [name for name in cell.views if name.startswith("A")]
        name = max(inner, key=lambda n: clean.views[n] - cell.views[n])
        place = list(cell.views).index(name)
        _, usual = panels(strip_path(pictures, clean), place, len(clean.views))
        own, shown = panels(strip_path(pictures, cell), place, len(cell.views))
        axes.imshow(np.concatenate([own, usual, shown], 1))
        axes.set_title(f"{titles[cell.hazard]}: {clean.inner - (cell.inner or 0):.1f} dB lost", fontsize=9)
        axes.set_xlabel("truth  |  clean case  |  this", fontsize=7)
        axes.set(xticks=[], yticks=[])
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=120, format="jpeg", pil_kwargs={"quality": 85})


def panels(path: Path, place: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(truth, model) of one view from a strip of `count`, (H, W, 3) uint8."""
    strip = np.asarray(cv2.imread(str(path)))[..., ::-1]
    height, width = strip.shape[0] // 2, strip.shape[1] // count
    part = strip[:, place * width : (place + 1) * width]
    return part[:height], part[height:]
