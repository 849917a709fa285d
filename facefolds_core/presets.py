"""Training presets: named sets of values for the `train` section of params.yaml."""

from __future__ import annotations

from typing import Any

PAPER: dict[str, Any] = {
    # FaceFolds, "Training details" and "Architecture Details".
    "layers": 12,
    "level_halfwidth": 0.03,
    "manifold_start": "sphere",
    "manifold_layers": 3,
    "manifold_width": 128,
    # Ours: a step at the paper's rate then moves the surfaces as far as in the paper's network (docs/method.md).
    "output_scale": 0.36,
    "texture_layers": 8,
    "texture_width": 256,
    "latent_dim": 32,
    "uv_frequencies": 10,
    "level_frequencies": 4,
    "view_frequencies": 4,
    "search_samples": 256,
    "rays": 32768,
    "iterations": 500_000,
    "lr_manifold": 7e-4,
    "lr_texture": 1e-3,
    "decay_manifold": 0.05,
    "decay_texture": 0.20,
    "decay_interval": 200_000,
    "lambda_view": 1.0,
    "lambda_reg": 1e-4,
}

QUICK: dict[str, Any] = {
    **PAPER,
    "layers": 6,
    "manifold_start": "surface",
    "manifold_width": 64,
    "output_scale": 1.0,
    "texture_layers": 4,
    "texture_width": 96,
    "uv_frequencies": 7,
    "search_samples": 24,
    "rays": 2048,
    "iterations": 4_000,
    "lr_manifold": 1e-4,
    "lr_texture": 4e-3,
    "lambda_reg": 1e-6,
    "decay_interval": 4_000,
}

FAST: dict[str, Any] = {
    # The explicit model (docs/method.md). It takes layers, level_halfwidth, iterations, lr_texture, lr_volume,
    # lambda_veil and lambda_solid; the other keys are the perceptrons' and have no effect.
    **PAPER,
    "model": "explicit",
    "level_halfwidth": 0.006,
    "manifold_start": "surface",
    "iterations": 460,
    "lr_texture": 0.02,
}

PRESETS: dict[str, dict[str, Any]] = {"fast": FAST, "paper": PAPER, "quick": QUICK}
