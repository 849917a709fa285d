"""The outer zone: the compiled kernel against its torch reference, and what it can explain."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume import kernel, room_kernel, room_reference
from facefolds_core.training.volume.room import Room

RADIUS, STEP, FARTHEST, SAMPLES = 0.45, 0.15, 20.0, 60
PARAMS = ExplicitParams()


def _problem(rays: int = 120) -> dict[str, np.ndarray]:
    """Rays from around the ball, some past it, through noise."""
    rng = np.random.default_rng(0)
    origins = rng.normal(size=(rays, 3)).astype(np.float32)
    origins /= np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.8, 0.8, (rays, 3)).astype(np.float32) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    grid = rng.random((18, 18, 18, 4), np.float32)
    grid[..., 0] = rng.normal(-2, 1, grid.shape[:3])
    return {
        "origins": origins,
        "directions": directions,
        "jitter": rng.random(rays, np.float32),
        "grid": grid,
        "beyond": rng.random((rays, 3), np.float32),
        "slope": rng.normal(size=(rays, 3)).astype(np.float32),
    }


def test_looking_and_its_gradient_match_autograd() -> None:
    p = _problem()
    rgb, through = room_kernel.look(p["origins"], p["directions"], p["jitter"], p["grid"], RADIUS, STEP, FARTHEST)
    gradient, touched = kernel.empty_gradient(p["grid"].shape)
    room_kernel.splat(
        *(p[k] for k in ("origins", "directions", "jitter", "grid")),
        RADIUS,
        STEP,
        FARTHEST,
        SAMPLES,
        p["beyond"],
        p["slope"],
        gradient,
        touched,
    )
    t = {name: torch.from_numpy(value).double() for name, value in p.items()}
    t["grid"].requires_grad_()
    colour, left = room_reference.look(
        t["origins"], t["directions"], t["jitter"], t["grid"], RADIUS, STEP, FARTHEST, SAMPLES
    )
    ((colour + left[:, None] * t["beyond"]) * t["slope"]).sum().backward()
    assert 0.05 < float(left.detach().median()) < 0.95
    np.testing.assert_allclose(rgb, colour.detach().numpy(), atol=5e-3)
    np.testing.assert_allclose(through, left.detach().numpy(), atol=5e-3)
    expected = t["grid"].grad.numpy()
    # The kernel leaves out clear samples and stops behind a transmittance of 0.001.
    np.testing.assert_allclose(gradient.sum(0), expected, atol=1e-2)
    assert np.abs(expected).max() > 0.3


def test_points_of_the_ball_stay_and_infinity_is_at_two() -> None:
    points = torch.tensor([[0.3, -0.2, 0.1], [0.0, 1.0, 0.0], [0.0, 0.0, 4.0], [1e9, 0.0, 0.0]])
    expected = [[0.3, -0.2, 0.1], [0.0, 1.0, 0.0], [0.0, 0.0, 1.75], [2.0, 0.0, 0.0]]
    np.testing.assert_allclose(room_reference.contract(points).numpy(), expected, atol=1e-6)


def _wall(rays: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays from cameras 1 unit away through the ball onto a chequered wall at x = -1: origins, directions, colours."""
    rng = np.random.default_rng(seed)
    azimuth = rng.uniform(-0.8, 0.8, rays)
    origins = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(rays)], 1)
    directions = np.stack([np.zeros(rays), *rng.uniform(-0.4, 0.4, (2, rays))], 1) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hit = origins + ((-1 - origins[:, 0]) / directions[:, 0])[:, None] * directions
    bright = (np.floor(hit[:, 1] / 0.4) + np.floor(hit[:, 2] / 0.4)) % 2
    colours = np.stack([0.2 + 0.6 * bright, 0.8 - 0.6 * bright, np.full(rays, 0.5)], 1)
    return origins.astype(np.float32), directions.astype(np.float32), colours.astype(np.float32)


def test_a_near_wall_is_explained_with_its_parallax() -> None:
    room = Room(np.full(3, 0.5, np.float32), 1.0, RADIUS, PARAMS.room, PARAMS.environment)
    room.refine(33)
    rng = np.random.default_rng(0)
    errors = []
    for i in range(120):
        origins, directions, colours = _wall(2000, i)
        seen = room.look(origins, directions, rng.random(2000, np.float32))
        room.step(seen, seen.colours - colours, 1.0, 0.3, 0.03)
        errors.append(float(((seen.colours - colours) ** 2).mean()))
    origins, directions, colours = _wall(2000, 999)
    error = float(((room.look_up(origins, directions) - colours) ** 2).mean())
    # The far sphere alone cannot hold it: its one picture is looked at from everywhere.
    assert error < 0.25 * errors[0]
    room.refine(49)
    assert float(((room.look_up(origins, directions) - colours) ** 2).mean()) == pytest.approx(error, rel=0.3)


def test_without_an_outer_zone_the_far_sphere_alone_is_behind() -> None:
    room = Room(np.full(3, 0.5, np.float32), 1.0, RADIUS, PARAMS.room, PARAMS.environment)
    origins, directions, colours = _wall(500, 0)
    seen = room.look(origins, directions, np.zeros(500, np.float32))
    expected, _, _ = room.environment.look_up(origins, directions)
    np.testing.assert_array_equal(seen.colours, expected)
    room.step(seen, seen.colours - colours, 1.0, 0.3, 0.03)
    assert not np.array_equal(room.look_up(origins, directions), expected)


def test_what_no_ray_reached_takes_its_neighbours_colours() -> None:
    room = Room(np.full(3, 0.2, np.float32), 1.0, RADIUS, PARAMS.room, PARAMS.environment)
    room.refine(17)
    room.grid[0, ..., 0] = 3.0
    room.grid[0, ..., 1:] = 0.2
    # A face left behind the head: bright where every ray is blocked.
    origins = np.tile(np.array([1, 0, 0], np.float32), (4000, 1))
    rng = np.random.default_rng(0)
    directions = np.stack([np.full(4000, -1.0), *rng.uniform(-0.8, 0.8, (2, 4000))], 1).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    blocked = directions[:, 0] < -0.93
    room.grid[0, :5, 6:11, 6:11, 1:] = 1.0
    straight = (origins[:1], np.array([[-1, 0, 0]], np.float32))
    assert room.look_up(*straight).mean() > 0.8
    room.forget_unseen(origins, directions, np.where(blocked, 0.0, 1.0).astype(np.float32))
    assert room.look_up(*straight).mean() < 0.5
