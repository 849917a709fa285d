"""The profile of a step: its multiply-adds are those that the sizes of the perceptrons give."""

import time
from pathlib import Path

import pytest
import torch

from bench import profile_step
from bench.profile_step import SECTIONS, report, take_apart
from facefolds_core.params import train_params
from facefolds_core.training import loop
from tests.scenes import OPAQUE, make_scene

TINY = {
    "preset": "quick", "layers": 2, "manifold_layers": 2, "manifold_width": 8, "texture_layers": 1, "texture_width": 8,
    "latent_dim": 2, "uv_frequencies": 2, "search_samples": 16, "rays": 64, "manifold_start": "sphere",
}  # fmt: skip


def test_multiply_adds_of_a_step(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, OPAQUE, size=20, surface_radius=0.33)
    params = train_params(TINY)
    step = take_apart(loop.begin(scene, params, tmp_path), params, time.process_time)
    field = 3 * 8 + 8 * 8 + 8
    assert step.products["search"] == 64 * 16 * field
    # Refinement evaluates the field once, then once with its slope, which costs as much again.
    assert step.products["refine"] == step.hits * 3 * field
    encoded = 2 * (1 + 2 * 2) + (1 + 2 * 4) + 2
    assert step.products["shade"] == step.hits * (encoded * 8 + 8 * 4 + (8 + 3 * (1 + 2 * 4)))
    # Pixels to rays is a 3 x 3 matrix each.
    assert (step.products["draw rays"], step.products["optimiser"]) == (64 * 9, 0)
    assert step.products["backward"] > 0
    assert set(step.seconds) == set(SECTIONS)
    text = report(step, 64, 1e9)
    assert "| search |" in text


def test_a_matrix_product_has_a_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(profile_step, "GEMM_SIZE", 64)
    ticks = iter([0.0, 0.5])
    assert profile_step.gemm_peak(torch.device("cpu"), lambda: next(ticks), repeats=1) == 64**3 / 0.5
