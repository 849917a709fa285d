"""A scene's cameras around the subject, from above and from its right, as SVG."""

from __future__ import annotations

from collections import Counter
from html import escape

import numpy as np

from facefolds_core.captures.scene import Scene

SIDE = 300
"""Pixels of each of the two drawings."""
LENGTH, HALF = 0.14, 0.05
"""Of a camera's triangle, in distances of the farthest camera: from its centre forward, and to both sides."""
COLOURS = {"train": "#4c78a8", "validate": "#54a24b", "holdout": "#e45756"}
VIEWS = (("from above", 0, 1), ("from its right", 0, 2))
"""What is drawn, and the world's axes that run to the right and up: the subject looks to the right."""


def sketch(scene: Scene) -> str:
    """Two drawings side by side; each camera is a triangle that opens where it looks to, with its name as its title."""
    counts = Counter[str](scene.splits)
    words = ", ".join(f'<tspan fill="{COLOURS[s]}">{counts[s]} {s}</tspan>' for s in COLOURS if counts[s])
    frames = f"{scene.num_frames} frame{'s' * (scene.num_frames > 1)}"
    title = f"{escape(scene.subject)}: {words}; {frames}, {scene.width} x {scene.height} pixels"
    parts = [_view(scene, SIDE * i, *view) for i, view in enumerate(VIEWS)]
    return (
        f'<svg width="{2 * SIDE}" height="{SIDE + 24}" '
        f'font-family="sans-serif" font-size="13" fill="gray">{"".join(parts)}'
        f'<text x="8" y="{SIDE + 16}">{title}</text></svg>'
    )


def _view(scene: Scene, left: float, words: str, across: int, up: int) -> str:
    centres = np.array([camera.centre for camera in scene.cameras])
    scale = 0.45 * SIDE / max(float(np.abs(centres).max()), 1e-6)
    reach = float(np.linalg.norm(centres, axis=1).max())
    middle = np.array([left + SIDE / 2, SIDE / 2])

    def at(point: np.ndarray) -> str:
        x, y = middle + scale * np.array([point[across], -point[up]])
        return f"{x:.0f},{y:.0f}"

    shapes = []
    for camera, split in zip(scene.cameras, scene.splits, strict=True):
        ahead = camera.centre + LENGTH * reach * camera.forward
        aside = HALF * reach * camera.rotation[0 if up == 1 else 1]
        corners = " ".join(map(at, (camera.centre, ahead + aside, ahead - aside)))
        name = escape(camera.name)
        shapes.append(f'<polygon points="{corners}" fill="{COLOURS[split]}"><title>{name} ({split})</title></polygon>')
    x, y = middle
    radius, nose = 0.12 * reach * scale, 0.2 * reach * scale
    head = f'<circle cx="{x}" cy="{y}" r="{radius:.0f}"/><path d="M{x} {y}h{nose:.0f}" stroke="gray"/>'
    return f'<text x="{left + 8}" y="16">{words}</text>{head}{"".join(shapes)}'
