"""The map between directions and (u, v), and between (u, v) and texture coordinates."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from facefolds_core.geometry.sphere_uv import (
    directions_to_uv,
    points_to_uv,
    st_to_uv,
    texel_uv,
    uv_to_directions,
    uv_to_st,
)

WINDOW = (-0.4, 0.6, -0.3, 0.5)
UV = np.random.default_rng(0).uniform(-0.999, 0.999, (200, 2))


@pytest.mark.parametrize(
    ("direction", "uv"),
    [
        ((1, 0, 0), (0, 0)),
        ((0, 1, 0), (0, 1)),  # the subject's left
        ((0, -1, 0), (0, -1)),
        ((0, 0, 1), (1, 0)),  # the top of the head
        ((math.sqrt(0.5), 0, math.sqrt(0.5)), (0.5, 0)),
        ((math.sqrt(0.5), math.sqrt(0.5), 0), (0, 0.5)),
    ],
)
def test_directions_with_known_coordinates(direction: tuple[float, ...], uv: tuple[float, ...]) -> None:
    # The poles are clipped a hair inside: asin(1 - 1e-7) is 4.5e-4 rad short.
    assert directions_to_uv(np.array(direction, float)) == pytest.approx(uv, abs=3e-4)


def test_uv_to_directions_and_back() -> None:
    assert np.abs(directions_to_uv(uv_to_directions(UV)) - UV).max() < 1e-9
    assert np.linalg.norm(uv_to_directions(UV), axis=-1) == pytest.approx(1)


def test_points_give_back_centre_radius_and_direction() -> None:
    centre, radius = np.array([-0.25, 0.1, 0.0]), np.linspace(0.1, 3, 200)
    uv, r = points_to_uv(centre + radius[:, None] * uv_to_directions(UV), centre)
    assert np.abs(uv - UV).max() < 1e-9
    assert r == pytest.approx(radius)
    uv, r = points_to_uv(centre[None], centre)
    assert np.isfinite(uv).all() and r == [0]


def test_torch_and_numpy_agree() -> None:
    directions = uv_to_directions(torch.from_numpy(UV))
    assert isinstance(directions, torch.Tensor)
    assert directions_to_uv(directions).numpy() == pytest.approx(directions_to_uv(uv_to_directions(UV)))


def test_gradients_are_finite_at_the_poles() -> None:
    directions = torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]], requires_grad=True)
    directions_to_uv(directions)[:, 0].sum().backward()
    assert directions.grad is not None
    assert torch.isfinite(directions.grad).all()


def test_st_and_back_and_the_corners_of_a_window() -> None:
    assert st_to_uv(uv_to_st(UV, WINDOW), WINDOW) == pytest.approx(UV)
    u0, u1, v0, v1 = WINDOW
    corners = uv_to_st(np.array([[u1, v0], [u0, v1]]), WINDOW)
    assert corners == pytest.approx(np.array([[0, 0], [1, 1]]))  # top left is (u1, v0)


def test_texel_centres() -> None:
    uv = texel_uv(2, 4, WINDOW)
    assert uv.shape == (2, 4, 2)
    assert uv[0, 0] == pytest.approx([0.6 - 0.25, -0.3 + 0.1])
    assert uv[1, 3] == pytest.approx([-0.4 + 0.25, 0.5 - 0.1])
