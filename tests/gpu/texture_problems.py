"""Of the texture steps' kernels, with the settings that `fast` trains with."""

from __future__ import annotations

from typing import Any

import numpy as np

from facefolds_core.kernels.adam import decays
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit import adam_kernel, kernels_gpu, shading_kernel, smoothing
from facefolds_core.training.explicit.rates import BETAS
from facefolds_core.training.explicit.state import MIN_ALPHA, MIN_LIGHT
from tests.gpu.problem import Problem

FAST = ExplicitParams()
RAYS, LAYERS, SAMPLES, SHAPE = 60, FAST.layers, 4, (9, 7)
TEXELS = SHAPE[0] * SHAPE[1]


def shading(late: bool, shining: bool) -> Problem:
    """A step of the rounds of geometry, or one of those after them; a third of the alphas is faint."""
    rng = np.random.default_rng(0)
    codes = rng.integers(1, 65536, (RAYS, LAYERS, 2)).astype(np.uint16)
    codes[rng.random((RAYS, LAYERS)) < 0.2] = 0
    finer = rng.integers(1, 65536, (RAYS // 3, SAMPLES, LAYERS, 2)).astype(np.uint16)
    texture = rng.random((*SHAPE, LAYERS, 4), np.float32)
    texture[..., 3] *= rng.choice(np.array([0.002, 0.2, 0.9], np.float32), (*SHAPE, LAYERS))
    faint = np.float32(MIN_ALPHA if late else 0.0)
    opacity = rng.integers(0, 256, (2, RAYS, 1))
    arguments = {
        "codes": codes,
        "finer": finer,
        "which": np.where(np.arange(RAYS) % 3 == 1, np.arange(RAYS) // 3, -1).astype(np.int32),
        "camera": rng.integers(0, 2, RAYS).astype(np.int32),
        "pixel": rng.permutation(RAYS).astype(np.int32),
        "rays": np.arange(0, RAYS, 2),
        "cut": np.concatenate([rng.random((2, RAYS, 3)) * opacity, opacity], -1).astype(np.uint8),
        "behind": rng.random((2, 3), np.float32),
        "texture": texture,
        "shine": rng.random((RAYS if shining else 0, 3), np.float32) * 0.4 - 0.2,
        "gradient": np.zeros((LAYERS, *SHAPE, 4), np.float32),
        "terms": (faint, MIN_LIGHT, False),
        "squares": np.zeros(4),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        *others, terms, squares = given.values()
        # Which rays a sum holds is the GPU's affair.
        for k in range(len(squares)):
            taken = {**given, "rays": given["rays"][k :: len(squares)]}
            squares[k] = shading_kernel.shade(*[taken[name] for name in list(given)[: len(others)]], *terms)

    # Worst seen: 3e-8 and 0 (of 3.5).
    outputs = {"gradient": 1e-6, "squares": 1e-6}
    return Problem(kernels_gpu.shade, RAYS // 2, arguments, outputs, on_cpu, {"LAYERS": LAYERS, "SAMPLES": SAMPLES})


def contributions() -> Problem:
    given = shading(True, False).arguments
    arguments = {name: given[name] for name in ("codes", "rays", "texture")}
    arguments |= {"peak": np.zeros((LAYERS, *SHAPE), np.float32), "min_light": MIN_LIGHT}
    constants = {"LAYERS": LAYERS}

    def on_cpu(given: dict[str, Any]) -> None:
        shading_kernel.contributions(*given.values())

    return Problem(kernels_gpu.contributions, RAYS // 2, arguments, {"peak": 1e-6}, on_cpu, constants)


def _parts(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Values and moments."""
    shapes = {"colour": (3,), "layers": (LAYERS, 4), "frame_colour": (3,), "frame_alpha": (LAYERS,)}
    parts = {name: rng.normal(size=(3, TEXELS, *shape)).astype(np.float32) for name, shape in shapes.items()}
    for part in parts.values():
        part[2] = np.abs(part[2])
    return parts


def activation() -> Problem:
    values = {name: part[0] for name, part in _parts(np.random.default_rng(1)).items()}
    arguments = {**values, "out": np.zeros((TEXELS, LAYERS, 4), np.float32)}

    def on_cpu(given: dict[str, Any]) -> None:
        adam_kernel.activate(*given.values())

    return Problem(kernels_gpu.activate, TEXELS, arguments, {"out": 1e-6}, on_cpu)


def adam() -> Problem:
    rng = np.random.default_rng(2)
    parts = _parts(rng)
    gradient = rng.normal(size=(LAYERS, TEXELS, 4)).astype(np.float32)
    gradient[rng.random((LAYERS, TEXELS)) < 0.4] = 0
    gradient[:, :5] = 0
    arguments = {
        **parts,
        "texture": rng.random((TEXELS, LAYERS, 4), np.float32),
        "gradient": gradient,
        "rates": np.array([0.02, 0.006, 0.3, 0.01, 0.15], np.float32),
        "keep": np.float32(FAST.textures.frame_decay),
        "correct": np.array([1.5, 2.0, 4.0, 6.0], np.float32),
        "decay": decays(BETAS),
    }

    def on_cpu(given: dict[str, Any]) -> None:
        adam_kernel.adam_step(*given.values())

    outputs = dict.fromkeys([*parts, "gradient"], 2e-6)  # worst seen: 2.4e-7 of 3.7
    return Problem(kernels_gpu.adam_step, TEXELS, arguments, outputs, on_cpu)


def smoothed() -> Problem:
    values = np.random.default_rng(3).normal(size=(TEXELS, LAYERS)).astype(np.float32)
    arguments = {"values": values, "height": SHAPE[0], "width": SHAPE[1], "out": np.zeros_like(values)}

    def on_cpu(given: dict[str, Any]) -> None:
        given["out"][:] = smoothing.smooth(given["values"], given["height"], given["width"])

    return Problem(kernels_gpu.smooth, TEXELS, arguments, {"out": 1e-6}, on_cpu, {"LAYERS": LAYERS})


def drawn() -> Problem:
    values, goal = np.random.default_rng(4).normal(size=(2, TEXELS, LAYERS)).astype(np.float32)

    def on_cpu(given: dict[str, Any]) -> None:
        given["values"] += given["share"] * (given["goal"] - given["values"])

    arguments = {"values": values, "goal": goal, "share": np.float32(0.25)}
    return Problem(kernels_gpu.go_towards, TEXELS, arguments, {"values": 1e-6}, on_cpu)


PROBLEMS = {
    "shading in the rounds": lambda: shading(False, False),
    "shading of textures": lambda: shading(True, False),
    "shading with a reflection": lambda: shading(True, True),
    "contributions": contributions,
    "activation": activation,
    "adam of textures": adam,
    "smoothing": smoothed,
    "drawn": drawn,
}
