"""Of the starting volume's kernels and the search for crossings, with the settings of `fast`."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.model import radial, radial_gpu, radial_kernel
from facefolds_core.params import ExplicitParams
from facefolds_core.training.adam import decays
from facefolds_core.training.volume import kernel, kernels_gpu, look_kernel, room_kernel
from tests.gpu.problem import Problem

FAST = ExplicitParams()
RAYS, THREADS, GRID = 24, 16, (13, 9, 11)
LOWER, VOXEL = np.array([-0.4, -0.3, -0.35]), 0.07
RADIUS, VOXELS = 0.45, 9
STEP = FAST.room.step * 4 / (VOXELS - 1)
ROOM = (RADIUS, STEP, 4.0 / (VOXELS - 1), FAST.room.farthest)


def _rays(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Origins, directions, jitter of rays through the box from one unit away."""
    origins = rng.normal(size=(RAYS, 3)).astype(np.float32)
    origins[:, 0] = np.abs(origins[:, 0]) + 0.3
    origins /= np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.2, 0.2, (RAYS, 3)).astype(np.float32) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True), rng.random(RAYS, np.float32)


def _grid(rng: np.random.Generator, shape: tuple[int, ...], density: float) -> np.ndarray:
    grid = rng.random((*shape, 4), np.float32)
    grid[..., 0] = rng.normal(density, 1.5, shape)
    return grid


def _scratch(samples: int) -> dict[str, np.ndarray]:
    return {
        "corners": np.zeros((samples, THREADS, 3), np.int32),
        "values": np.zeros((samples, THREADS, 9), np.float32),
    }


def shading() -> Problem:
    rng = np.random.default_rng(0)
    colours = rng.random((2, RAYS, 3), np.float32)
    matte = np.where(rng.random(RAYS) < 0.5, rng.random(RAYS), -1).astype(np.float32)
    volume = FAST.volume
    arguments = {
        "rays": (*_rays(rng), *colours, matte),
        "grid": _grid(rng, GRID, -1.0),
        "occupied": rng.random(tuple(n // kernel.BLOCK + 1 for n in GRID)) < 0.9,
        "lower": LOWER,
        "lengths": (VOXEL, volume.step * VOXEL),
        "gradient": np.zeros((1, *GRID, 4), np.float32),
        "touched": np.zeros((1, *GRID[:2]), np.bool_),
        "residual": np.zeros((RAYS, 3), np.float32),
        "transmittance": np.zeros(RAYS, np.float32),
        "weights": (volume.opacity_weight, volume.binarisation_weight, volume.matte_weight),
        "squares": np.zeros(1),
        **_scratch(60),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        rays, grid, occupied, lower, lengths, *others = given.values()
        gradient, touched, residual, transmittance, weights, squares, _, _ = others
        parts, rows = kernel.empty_gradient((*GRID, 4))
        out = (parts, rows, residual, transmittance)
        squares[0] = kernel.shade(*rays, grid, occupied, lower, *lengths, 60, *out, *weights)
        gradient[0], touched[0] = parts.sum(0), rows.any(0)

    # Worst seen: 6e-8, 0, 1.8e-7, 3e-8, 2.3e-7.
    outputs = {"gradient": 3e-6, "touched": 0, "residual": 1e-6, "transmittance": 1e-6, "squares": 1e-5}
    return Problem(kernels_gpu.shade, THREADS, arguments, outputs, on_cpu)


def rendering() -> Problem:
    rng = np.random.default_rng(1)
    origins, directions, _ = _rays(rng)
    arguments = {
        "origins": origins,
        "directions": directions,
        "grid": _grid(rng, GRID, 0.0),
        "lower": LOWER,
        "voxel": VOXEL,
        "step": FAST.volume.step * VOXEL,
        "rgb": np.zeros((RAYS, 3), np.float32),
        "alpha": np.zeros(RAYS, np.float32),
        "depth": np.zeros(RAYS, np.float32),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        *others, rgb, alpha, depth = given.values()
        rgb[:], alpha[:], depth[:] = look_kernel.render(*others)

    outputs = {"rgb": 1e-6, "alpha": 1e-6, "depth": 1e-6}
    return Problem(kernels_gpu.render, RAYS, arguments, outputs, on_cpu)


def density() -> Problem:
    grid = np.random.default_rng(2).random((3, *GRID, 4), np.float32)

    def on_cpu(given: dict[str, Any]) -> None:
        given["out"][:] = given["grid"][0, ..., 0]

    arguments = {"grid": grid, "out": np.zeros(GRID, np.float32)}
    return Problem(kernels_gpu.copy_density, int(np.prod(GRID)), arguments, {"out": 0}, on_cpu)


def adam() -> Problem:
    rng = np.random.default_rng(3)
    grid = np.stack([_grid(rng, GRID, 0.0), *rng.random((2, *GRID, 4), np.float32)])
    touched = rng.random((1, *GRID[:2])) < 0.6
    gradient = rng.normal(size=(1, *GRID, 4)).astype(np.float32) * touched[..., None, None]
    gradient[rng.random((1, *GRID)) < 0.3] = 0
    volume = FAST.volume
    rates = (volume.learning_rate, volume.colour_learning_rate, 1.5, 2.5, volume.smoothness_weight)
    arguments = {
        "grid": grid,
        "gradient": gradient,
        "touched": touched,
        "old": grid[0, ..., 0].copy(),
        "share": rng.random(GRID, np.float32),
        "rates": rates,
        "decay": decays(volume.betas),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        touched = given["touched"].copy()  # the GPU's host clears it
        kernel.adam_step(
            given["grid"], given["gradient"], touched, given["share"], *rates[:4], given["decay"], rates[4]
        )

    outputs = {"grid": 2e-6, "gradient": 0}
    return Problem(kernels_gpu.adam_step, int(np.prod(GRID)), arguments, outputs, on_cpu)


def looking() -> Problem:
    rng = np.random.default_rng(4)
    arguments = {
        **dict(zip(("origins", "directions", "jitter"), _rays(rng), strict=True)),
        "grid": _grid(rng, (VOXELS,) * 3, -1.0),
        "lengths": ROOM,
        "rgb": np.zeros((RAYS, 3), np.float32),
        "through": np.zeros(RAYS, np.float32),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        *rays, grid, _, rgb, through = given.values()
        rgb[:], through[:] = room_kernel.look(*rays, grid, RADIUS, STEP, FAST.room.farthest)

    return Problem(kernels_gpu.look, RAYS, arguments, {"rgb": 1e-6, "through": 1e-6}, on_cpu)


def splatting() -> Problem:
    rng = np.random.default_rng(5)
    shape = (VOXELS,) * 3
    beyond, slope = rng.random((2, RAYS, 3), np.float32)
    arguments = {
        "rays": (*_rays(rng), beyond, slope - 0.5),
        "grid": _grid(rng, shape, -1.0),
        "lengths": ROOM,
        "gradient": np.zeros((1, *shape, 4), np.float32),
        "touched": np.zeros((1, *shape[:2]), np.bool_),
        **_scratch(int(8 / STEP)),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        (*rays, beyond, slope), grid, _, gradient, touched, _, _ = given.values()
        parts, rows = kernel.empty_gradient((*shape, 4))
        lengths = RADIUS, STEP, FAST.room.farthest, int(8 / STEP)
        room_kernel.splat(*rays, grid, *lengths, beyond, slope, parts, rows)
        gradient[0], touched[0] = parts.sum(0), rows.any(0)

    return Problem(kernels_gpu.splat, THREADS, arguments, {"gradient": 3e-6, "touched": 0}, on_cpu)


def tracing(belt: Belt | None = None) -> Problem:
    origins, directions, _ = _rays(np.random.default_rng(6))
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


PROBLEMS = {
    "shading of the volume": shading,
    "rendering of the volume": rendering,
    "copy of the density": density,
    "adam of the volume": adam,
    "looking at the room": looking,
    "splatting into the room": splatting,
    "tracing": tracing,
    "tracing below a belt": partial(tracing, Belt(0.2, 0.3)),
}
