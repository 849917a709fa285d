"""The training's curves as inline SVG, coloured by the page's style sheet; colours of the heat map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from matplotlib import colormaps

HEAT = "viridis"
EQUAL_CONTRAST = 0.179
"""Luminance on which black and white are read equally well (WCAG: (L + 0.05) / 0.05 = 1.05 / (L + 0.05))."""
WIDTH, HEIGHT, MARGIN = 320, 160, 16
"""Of a chart, pixels; above and below the curve there is room for a line of text."""


def line_chart(points: Sequence[tuple[float, float]]) -> Markup:
    """A line over rising x; the greatest and the least value stand at its left, the last x at its right."""
    x, y = np.asarray(points, float).T
    span = max(float(np.ptp(y)), 1e-12)
    across = WIDTH * (x - x[0]) / max(float(np.ptp(x)), 1e-12)
    down = MARGIN + (HEIGHT - 2 * MARGIN) * (y.max() - y) / span
    path = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))
    return Markup(
        f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="from {y[0]:g} to {y[-1]:g}">'
        f'<polyline class="line" points="{path}"/><text x="0" y="{MARGIN - 4}">{y.max():g}</text>'
        f'<text x="0" y="{HEIGHT - 3}">{y.min():g}</text>'
        f'<text x="{WIDTH}" y="{HEIGHT - 3}" text-anchor="end">step {x[-1]:g}</text></svg>'
    )


def heat_colour(share: float) -> str:
    """#rrggbb for 0 to 1."""
    red, green, blue, _ = colormaps[HEAT](float(np.clip(share, 0, 1)))
    return "#" + "".join(f"{round(255 * c):02x}" for c in (red, green, blue))


def ink_on(share: float) -> str:
    """Black or white, whichever is read better on `heat_colour`."""
    red, green, blue, _ = colormaps[HEAT](float(np.clip(share, 0, 1)))
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (red, green, blue)]
    return "#000000" if 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] > EQUAL_CONTRAST else "#ffffff"
