"""Cameras: projection, rays, resizing, moving."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera, check_camera
from facefolds_core.geometry.similarity import Similarity

ROTATION = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
ROTATION = ROTATION * np.linalg.det(ROTATION)


def camera() -> Camera:
    K = np.array([[800.0, 1.5, 201.0], [0, 790.0, 310.0], [0, 0, 1]])
    return Camera("a", K, np.concatenate([ROTATION, [[0.1], [-0.2], [3.0]]], 1), 400, 600)


def points() -> np.ndarray:
    in_camera = np.random.default_rng(5).uniform([-0.5, -0.5, 1], [0.5, 0.5, 5], (50, 3))
    return (in_camera - camera().w2c[:, 3]) @ camera().rotation


def test_projection_of_a_point_on_the_axis_is_the_principal_point() -> None:
    pixel, depth = camera().project(camera().centre + 2.5 * camera().forward)
    assert pixel == pytest.approx([201.0, 310.0])
    assert depth == pytest.approx(2.5)


def test_rays_go_through_what_projects_to_their_pixels() -> None:
    pixels, _ = camera().project(points())
    origins, directions = camera().rays(pixels)
    along = ((points() - origins) * directions).sum(-1, keepdims=True)
    assert np.abs(origins + along * directions - points()).max() < 1e-12


def test_default_rays_are_those_of_the_pixel_centres() -> None:
    origins, directions = camera().rays()
    pixels, _ = camera().project(origins + directions)
    assert pixels[7, 11] == pytest.approx([11.5, 7.5])
    assert pixels.shape == (600, 400, 2)


def test_resizing_scales_projections() -> None:
    small = camera().resized(100, 200)
    assert np.abs(small.project(points())[0] - camera().project(points())[0] * [1 / 4, 1 / 3]).max() < 1e-10


def test_projection_does_not_change_when_world_and_camera_move_together() -> None:
    move = Similarity(0.013, ROTATION.T @ ROTATION.T, np.array([5.0, -3.0, 2.0]))
    moved, depth = camera().transformed(move).project(move.apply(points()))
    before, depth_before = camera().project(points())
    assert np.abs(moved - before).max() < 1e-9
    assert depth == pytest.approx(0.013 * depth_before)


@pytest.mark.parametrize(
    ("K", "w2c", "message"),
    [
        (np.diag([0.0, 1, 1]), None, "singular"),
        (np.diag([-5.0, 5, 1]), None, "singular"),
        (np.diag([np.nan, 5, 1]), None, "not finite"),
        (None, np.zeros((3, 4)), "not a rotation"),
        (None, np.diag([1.0, 1, -1])[:, [0, 1, 2, 0]], "not a rotation"),
    ],
)
def test_a_camera_that_cannot_project_is_refused(K: np.ndarray | None, w2c: np.ndarray | None, message: str) -> None:
    check_camera(camera(), "KRT", "camera a")
    bad = replace(camera(), K=camera().K if K is None else K, w2c=camera().w2c if w2c is None else w2c)
    with pytest.raises(UserError, match=message) as error:
        check_camera(bad, "KRT", "camera a")
    assert error.value.place == "camera a"
