"""Where training starts: levels, search ball, outline of the tracked mesh."""

import math
from pathlib import Path

import numpy as np
import pytest
import torch

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.geometry.sphere_uv import uv_to_directions
from facefolds_core.model.manifolds import MlpManifolds
from facefolds_core.params import MlpParams
from facefolds_core.training import start as start_module
from facefolds_core.training.start import FILL, MARGIN, Outline, find_outline, find_start, fit_outline, fitted_radius
from tests.scenes import look_at_origin, make_scene

CENTRE = np.array(SPHERE_CENTRE)


def test_levels_straddle_the_tracked_mesh_outermost_first(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=8, surface_radius=0.33)
    start = find_start(scene, MlpParams(layers=7))
    assert start.levels == pytest.approx(np.linspace(0.36, 0.30, 7), abs=1e-6)
    assert start.radius == pytest.approx(0.33 + 0.03 + MARGIN, abs=1e-6)
    assert find_start(scene, MlpParams(layers=1)).levels == pytest.approx([0.33], abs=1e-6)


def test_without_a_mesh_a_ball_is_fitted_to_the_field_of_view(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=8)
    start = find_start(scene, MlpParams(layers=3))
    rho = 0.8 * math.sin(math.atan(0.35))  # the scene's cameras: focal length size / 0.7, distance 1
    r0 = math.sqrt(rho**2 + 0.25**2 + 0.25 * rho)
    assert start.outline is None
    assert start.levels == pytest.approx([r0 + 0.03, r0, r0 - 0.03])
    assert start.radius == pytest.approx(rho + 0.25 + 0.03 + MARGIN)


def test_fitted_radius_is_the_median_over_the_front_of_the_ball() -> None:
    r0, farthest = fitted_radius([look_at_origin("a", 0, 0, 8)], FILL)
    rho = farthest - 0.25
    n = np.random.default_rng(0).normal(size=(200_000, 3))
    points = rho * n / np.linalg.norm(n, axis=1, keepdims=True)
    front = points[points[:, 0] > 0]
    assert r0 == pytest.approx(np.median(np.linalg.norm(front - CENTRE, axis=1)), rel=2e-3)


def test_outline_leaves_out_what_is_behind_other_surface() -> None:
    uv = np.stack(np.meshgrid(np.linspace(-0.5, 0.5, 30), np.linspace(-0.5, 0.5, 30)), -1).reshape(-1, 2)
    outer = CENTRE + 0.33 * uv_to_directions(uv)
    hidden = CENTRE + 0.25 * uv_to_directions(uv)
    behind = CENTRE - 0.4 * uv_to_directions(uv)
    outline = find_outline(np.concatenate([outer, hidden, behind]))
    assert outline.radii == pytest.approx(np.full(len(uv), 0.33))


def test_fit_brings_the_middle_level_onto_the_outline(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = np.linspace(-0.9, 0.9, 25)
    uv = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)
    directions = uv_to_directions(uv)
    outline = Outline(directions, 0.32 + 0.03 * directions[:, 1])
    torch.manual_seed(0)
    manifolds = MlpManifolds(SPHERE_CENTRE, (0.35, 0.32, 0.29), 0.45, 3, 32, 64)
    monkeypatch.setattr(start_module, "ITERATIONS", 150)
    monkeypatch.setattr(start_module, "POINTS", 1024)
    error = fit_outline(manifolds, outline, torch.Generator().manual_seed(0))
    n = torch.from_numpy(directions).float()
    found = manifolds.crossings(manifolds.centre + 0.45 * n, -n)
    radii = (found.points[:, 1] - manifolds.centre).norm(dim=-1).detach().numpy()
    assert error < 2e-3
    assert np.abs(radii - outline.radii).mean() < 2e-3
