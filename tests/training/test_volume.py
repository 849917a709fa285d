"""The starting volume: the compiled kernel against its torch reference, closed forms, and a tiny scene."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from tqdm import tqdm

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.errors import UserError
from facefolds_core.geometry.chart import Chart
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.tracked import share_off
from facefolds_core.training.volume import fit, kernel, outline, reference, sight
from facefolds_core.training.volume.cameras import CameraFit
from facefolds_core.training.volume.environment import Environment
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.room import Room
from facefolds_core.training.volume.subject import subject_of
from tests.scenes import OPAQUE, look_at_origin, make_scene

PARAMS = ExplicitParams()
START, LEAST = PARAMS.start, PARAMS.start.subject_opacity
LOWER = np.array([-0.4, -0.3, -0.35])
VOXEL = 0.05
ORIGIN = Chart((0.0, 0.0, 0.0))


def _problem(rays: int = 200) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    origins = rng.normal(size=(rays, 3)).astype(np.float32)
    origins /= np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.3, 0.3, (rays, 3)).astype(np.float32) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    grid = rng.random((17, 13, 15, 4), np.float32)
    grid[..., 0] = rng.normal(-2, 2, grid.shape[:3])
    colours = rng.random((2, rays, 3), np.float32)
    return {
        "origins": origins,
        "directions": directions,
        "jitter": rng.random(rays, np.float32),
        "target": colours[0],
        "background": colours[1],
        "matte": np.where(rng.random(rays) < 0.5, rng.random(rays), -1).astype(np.float32),
        "grid": grid,
    }


def _shade(p: dict[str, np.ndarray], *weights: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    grid, rays = p["grid"], len(p["origins"])
    gradient, touched = kernel.empty_gradient(grid.shape)
    residual, transmittance = np.empty((rays, 3), np.float32), np.empty(rays, np.float32)
    occupied = np.ones(tuple(n // kernel.BLOCK + 1 for n in grid.shape[:3]), bool)
    squares = kernel.shade(
        *p.values(),
        occupied,
        LOWER,
        VOXEL,
        0.7 * VOXEL,
        200,
        gradient,
        touched,
        residual,
        transmittance,
        *weights,
    )
    return gradient.sum(0), residual, transmittance, squares


@pytest.mark.parametrize(
    "weights",
    [
        (0.0, 0.0, 0.0),
        (PARAMS.volume.opacity_weight, PARAMS.volume.binarisation_weight, PARAMS.volume.matte_weight),
        (0.02, 0.05, 0.7),
    ],
)
def test_shading_matches_autograd(weights: tuple[float, float, float]) -> None:
    p = _problem()
    gradient, residual, transmittance, squares = _shade(p, *weights)
    tensors = {name: torch.from_numpy(value).double() for name, value in p.items()}
    expected = reference.shade(*tensors.values(), torch.from_numpy(LOWER), VOXEL, 0.7 * VOXEL, *weights)
    # Worst seen 4e-7, 6e-7 and 2e-7: the reference leaves out clear samples and what lies behind opaque ones, too.
    np.testing.assert_allclose(gradient, expected[0].numpy(), atol=5e-6)
    np.testing.assert_allclose(residual, expected[1].numpy(), atol=5e-6)
    np.testing.assert_allclose(transmittance, expected[2].numpy(), atol=5e-6)
    assert squares == pytest.approx(float(expected[3]), rel=1e-6)


@pytest.mark.parametrize("density", [-kernel.LIMIT, kernel.LIMIT])
def test_shading_at_extreme_densities(density: float) -> None:
    p = _problem(50)
    p["grid"][..., 0] = density
    gradient, _, transmittance, squares = _shade(p, 0.1, 0.1, 0.1)
    assert np.isfinite(gradient).all() and math.isfinite(squares)
    assert ((transmittance >= 0) & (transmittance <= 1)).all()


def test_the_share_of_cameras_that_see_a_point_matches_the_reference() -> None:
    """Cameras in front of the points, behind them, and among them."""
    cameras = [look_at_origin(str(k), 40.0 * k, 10.0 * k - 30, 24, 1.0 if k < 5 else 0.2) for k in range(7)]
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (500, 3))
    expected = reference.seen_share(cameras, points)
    assert len(set(expected)) > 4
    np.testing.assert_array_equal(sight.seen_share(cameras, points), expected)


def _ball(radius: float, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Volume:
    """An opaque red ball in an empty box."""
    axis = np.linspace(-0.45, 0.45, 91)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)
    inside = radius - np.linalg.norm(points - np.array(centre), axis=-1)
    grid = np.zeros((91, 91, 91, 4), np.float32)
    grid[..., 0] = (inside / 0.01 * 10).clip(-kernel.LIMIT, kernel.LIMIT)
    grid[..., 1] = 1
    return Volume(
        grid,
        np.full(3, -0.45),
        0.01,
        PARAMS.volume.step,
        Room(np.zeros(3, np.float32), 1.0, 0.45, PARAMS.room, PARAMS.environment),
        0,
        30.0,
        CameraFit.alike(1, PARAMS.cameras),
    )


def test_profile_of_a_ball() -> None:
    chart = Chart((-0.1, 0.0, 0.0))
    uv = outline.window_uv((-0.6, 0.6, -0.6, 0.6), 9, 9)
    seen = outline.profile(_ball(0.3), chart, uv, LEAST)
    b = chart.directions(uv) @ np.array(chart.centre)
    expected = -b + np.sqrt(b**2 - 0.1**2 + 0.3**2)
    np.testing.assert_allclose(seen.radius, expected, atol=0.01)
    assert (seen.outer >= seen.radius).all() and (seen.radius >= seen.inner).all()
    np.testing.assert_allclose(seen.opacity, 1, atol=2e-3)
    np.testing.assert_allclose(seen.rgb[..., 0], 1, atol=1e-3)


def test_profile_beside_the_ball_is_clear() -> None:
    seen = outline.profile(_ball(0.1, (0.25, 0, 0)), ORIGIN, outline.window_uv((0.9, 1, -1, 1), 3, 3), LEAST)
    assert np.isnan(seen.radius).all()
    np.testing.assert_allclose(seen.opacity, 0, atol=1e-3)


def test_what_floats_is_removed() -> None:
    ball, crumb = _ball(0.25), _ball(0.05, (0.38, 0.0, 0.0))
    both = replace(ball, grid=np.where(crumb.grid[..., :1] > ball.grid[..., :1], crumb.grid, ball.grid))
    outward = np.zeros((1, 2))
    assert outline.profile(both, ORIGIN, outward, LEAST).radius[0] == pytest.approx(0.43, abs=0.01)
    cleaned = subject_of(both, (), PARAMS)
    assert outline.profile(cleaned, ORIGIN, outward, LEAST).radius[0] == pytest.approx(0.25, abs=0.01)


def test_points_behind_the_centre_are_lost() -> None:
    ball = _ball(0.2)
    n = np.random.default_rng(0).normal(size=(4000, 3))
    points = 0.2 * n / np.linalg.norm(n, axis=1, keepdims=True)
    front = points[points[:, 0] > 0]
    assert outline.lost_share(ball, Chart((-0.35, 0.0, 0.0)), front, START) == pytest.approx(0, abs=0.01)
    assert outline.lost_share(ball, ORIGIN, points, START.model_copy(update={"azimuth_limit": 0.9})) > 0.5


def test_environment_learns_what_it_is_shown() -> None:
    rng = np.random.default_rng(0)
    environment = Environment(np.full(3, 0.5, np.float32), 1.0, PARAMS.environment)
    n = rng.normal(size=(2000, 3)).astype(np.float32)
    directions = n / np.linalg.norm(n, axis=1, keepdims=True)
    origins = 0.3 * directions[::-1]
    wanted = np.stack([0.5 + 0.4 * directions[:, 0], np.full(2000, 0.2), 0.5 - 0.4 * directions[:, 2]], 1)
    for _ in range(200):
        seen, taps, weights = environment.look_up(origins, directions)
        environment.step(taps, weights, seen - wanted, 1.0)
    seen, _, _ = environment.look_up(origins, directions)
    assert np.abs(seen - wanted).mean() < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("resolution", [48, pytest.param(96, marks=pytest.mark.nightly)])
def test_a_sphere_is_found_from_images_alone(tmp_path: Path, resolution: int) -> None:
    scene = make_scene(tmp_path, size=64)
    levels = [{"resolution": r, "iterations": 120 * resolution // 96} for r in (resolution // 2, resolution)]
    params = ExplicitParams.model_validate({"volume": {"levels": levels}})
    volume = subject_of(fit.fit_volume(scene, params, tqdm(disable=True)), (), params)
    seen = outline.profile(volume, Chart(SPHERE_CENTRE), outline.window_uv((-0.3, 0.3, -0.3, 0.3), 9, 9), LEAST)
    voxel = 0.008 * 96 / resolution
    assert np.nanmedian(seen.radius) == pytest.approx(OPAQUE[0].radius, abs=voxel)


def test_cameras_that_look_elsewhere_are_refused(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=16)
    away = [replace(c, w2c=c.w2c * np.array([[1], [-1], [-1]])) for c in scene.cameras]
    with pytest.raises(UserError, match="one place"):
        fit.bounding_box(away, PARAMS.volume)


@pytest.mark.parametrize(("scale", "wrong"), [(1.0, False), (1.2, True), (0.8, True)])
def test_a_tracked_mesh_of_another_size_is_found_out(scale: float, wrong: bool) -> None:
    centre = np.array([-0.1, 0.0, 0.0])
    ball = trimesh.creation.icosphere(4, 0.3)
    vertices = centre + scale * (np.asarray(ball.vertices)[None] - centre)
    share = share_off(_ball(0.3), Chart((-0.1, 0.0, 0.0)), vertices, ball.faces, PARAMS.mesh, START)
    assert (share > PARAMS.mesh.max_share_off) == wrong
    assert share > 0.95 or share < 0.05


def test_the_bounds_compiled_into_the_kernel_are_below_what_a_picture_shows() -> None:
    """Half a code of 255 is seen by nobody: bounds that change less are guards of arithmetic, no parameters."""
    half = 0.5 / 255
    assert half > kernel.OPAQUE  # what lies behind so little light adds at most as much
    voxel = math.log1p(math.exp(kernel.LIMIT)), math.log1p(math.exp(-kernel.LIMIT))
    assert math.exp(-voxel[0]) < half  # a voxel at the upper bound is opaque, across its side
    assert 1 - math.exp(-voxel[1]) < kernel.CLEAR < half  # one at the lower bound is left out
