"""Small charts as inline SVG, coloured by the page's style sheet, so that they follow light and dark."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape
from matplotlib import colormaps
from matplotlib.ticker import MaxNLocator

from facefolds_core.captures.scene import Split
from facefolds_core.scoring.terminal import SPLIT_WORDS

WIDTH, HEIGHT = 320, 190
LEFT, RIGHT, TOP, BOTTOM = 46, 10, 10, 30
MOST_POINTS = 240
HEAT = "viridis"

Point = tuple[float, float]


@dataclass(frozen=True)
class Frame:
    """The data's rectangle, mapped to the chart's."""

    x: tuple[float, float]
    y: tuple[float, float]

    def at(self, point: Point) -> Point:
        """Data -> pixels."""
        across = (point[0] - self.x[0]) / ((self.x[1] - self.x[0]) or 1)
        up = (point[1] - self.y[0]) / ((self.y[1] - self.y[0]) or 1)
        return LEFT + across * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)


def thinned(points: Sequence[Point], most: int = MOST_POINTS) -> list[Point]:
    """At most `most` points: means over as many equal parts of the list."""
    if len(points) <= most:
        return list(points)
    return [tuple(part.mean(0).tolist()) for part in np.array_split(np.asarray(points, float), most)]


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers within [low, high]."""
    if high <= low:
        return [low]
    found = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    slack = 1e-9 * (high - low)
    return [float(value) for value in found if low - slack <= value <= high + slack]


def tick_label(value: float) -> str:
    if value and (abs(value) >= 1e5 or abs(value) < 1e-3):
        return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e").replace("-", "−")
    return f"{value:g}".replace("-", "−")


def line_chart(points: Sequence[Point], name: str, x_label: str) -> Markup:
    """A line over rising x."""
    shown = thinned(points)
    xs, ys = zip(*shown, strict=True)
    low, high = min(ys), max(ys)
    if high == low:
        low, high = low - 0.5, high + 0.5
    frame = Frame((min(xs), max(xs)), (low, high))
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(frame.at, shown))
    title = f"{name} from {tick_label(ys[0])} to {tick_label(ys[-1])}"
    return _svg(title, _axes(frame, x_label), f'<polyline class="line" points="{path}"/>')


@dataclass(frozen=True)
class Dot:
    """A camera on the map: degrees to the subject's left and upwards."""

    azimuth: float
    elevation: float
    name: str
    split: Split


def camera_map(dots: Sequence[Dot]) -> Markup:
    """Where the cameras stand, as seen from the subject's front."""
    across = max(10.0, *(abs(dot.azimuth) for dot in dots)) * 1.1
    heights = [dot.elevation for dot in dots]
    middle, half = (min(heights) + max(heights)) / 2, max(10.0, (max(heights) - min(heights)) / 2 * 1.25)
    frame = Frame((-across, across), (middle - half, middle + half))
    marks = []
    for dot in sorted(dots, key=lambda one: list(SPLIT_WORDS).index(one.split)):
        x, y = frame.at((dot.azimuth, dot.elevation))
        held = dot.split == "holdout"
        kind = "held" if held else dot.split
        words = f"{dot.name}, {SPLIT_WORDS[dot.split]}"
        radius = 6 if held else 4
        marks.append(
            f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="{radius}"><title>{escape(words)}</title></circle>'
        )
        if held:
            label = f'<text class="name" x="{x:.1f}" y="{y - 10:.1f}" text-anchor="middle">{escape(dot.name)}</text>'
            marks.append(label)
    return _svg("Where the cameras stand", _axes(frame, "azimuth"), "".join(marks))


def heat_colour(share: float) -> str:
    """#rrggbb for 0 to 1."""
    red, green, blue, _ = colormaps[HEAT](float(np.clip(share, 0, 1)))
    return "#" + "".join(f"{round(255 * c):02x}" for c in (red, green, blue))


def ink_on(share: float) -> str:
    """Black or white, whichever is read better on `heat_colour`."""
    red, green, blue, _ = colormaps[HEAT](float(np.clip(share, 0, 1)))
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (red, green, blue)]
    return "#000000" if 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] > 0.179 else "#ffffff"


def _axes(frame: Frame, x_label: str) -> str:
    parts = []
    for value in ticks(*frame.y, 5):
        _, y = frame.at((frame.x[0], value))
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{tick_label(value)}</text>')
    for value in ticks(*frame.x, 5):
        x, _ = frame.at((value, frame.y[0]))
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 14}" text-anchor="middle">{tick_label(value)}</text>')
    label = f'<text class="label" x="{WIDTH - RIGHT}" y="{HEIGHT - 2}" text-anchor="end">{escape(x_label)}</text>'
    base = HEIGHT - BOTTOM
    return "".join(parts) + f'<line class="axis" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{base}" y2="{base}"/>' + label


def _svg(title: str, *parts: str) -> Markup:
    head = f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(title)}">'
    return Markup(head + "".join(parts) + "</svg>")
