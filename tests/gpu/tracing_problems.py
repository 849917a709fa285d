"""Of the search for crossings, with the settings of `fast`."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.model import radial, radial_gpu, radial_kernel
from facefolds_core.params import ExplicitParams
from tests.gpu.problem import Problem

FAST = ExplicitParams()
RAYS = 24


def _rays(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions of rays through the middle from one unit away."""
    origins = rng.normal(size=(RAYS, 3)).astype(np.float32)
    origins[:, 0] = np.abs(origins[:, 0]) + 0.3
    origins /= np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.2, 0.2, (RAYS, 3)).astype(np.float32) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def tracing(belt: Belt | None = None) -> Problem:
    origins, directions = _rays(np.random.default_rng(6))
    window = np.array([-0.6, 0.6, -0.6, 0.6]) if belt is None else np.array([-1.2, 0.6, -1.4, 1.4])
    waves = 0.03 * np.sin(np.arange(30) / 3)[:, None] + 0.02 * np.cos(np.arange(26) / 2)[None]
    rho = (0.3 + waves[..., None] + np.linspace(0.02, -0.02, FAST.layers)).astype(np.float32)
    numbers = Chart((0.0, 0.0, 0.0), belt).numbers
    arguments = {
        "offsets": origins.astype(np.float64),
        "directions": directions.astype(np.float64),
        "rho": rho,
        "window": window,
        "belt": numbers,
        "ceiling": radial_kernel.ceiling(rho, window, numbers),
        "bound": float(rho.max()) + radial.MARGIN + (0.0 if belt is None else 2 * belt.girth),
        "step": radial.STEP,
        "result": np.zeros((RAYS, FAST.layers), np.float32),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        *others, result = given.values()
        result[:] = radial_kernel.crossing_distances(*others)

    constants = {"LAYERS": FAST.layers}
    return Problem(radial_gpu.crossing_distances, RAYS, arguments, {"result": 1e-6}, on_cpu, constants)


PROBLEMS = {"tracing": tracing, "tracing below a belt": partial(tracing, Belt(0.2, 0.3))}
