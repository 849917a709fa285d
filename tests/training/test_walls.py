"""Flat things behind the subject."""

from __future__ import annotations

import numpy as np

from facefolds_core.params import WallParams
from facefolds_core.training.volume.walls import find_walls
from tests.scenes import look_at_origin

PARAMS = WallParams()
VOXEL = 0.01
CAMERAS = [look_at_origin("c", azimuth, 10.0, 64, 1.0) for azimuth in (-40, 0, 40)]


def _head(random: np.random.Generator, count: int = 6000) -> np.ndarray:
    """Points on the front of an ellipsoid."""
    points = random.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points[:, 0] = np.abs(points[:, 0])
    return points * [0.22, 0.16, 0.24]


def _wall(random: np.random.Generator, x: float, size: float, count: int = 3000) -> np.ndarray:
    return np.column_stack([x + 0.003 * random.normal(size=count), random.uniform(-size, size, (count, 2))])


def test_a_wall_behind_a_head_is_found_where_it_is() -> None:
    random = np.random.default_rng(1)
    points = np.concatenate([_head(random), _wall(random, -0.1, 0.45)])
    (wall,) = find_walls(points, CAMERAS, VOXEL, PARAMS)
    np.testing.assert_allclose(wall.normal, [1, 0, 0], atol=0.01)
    assert abs(wall.offset + 0.1) < 0.003
    np.testing.assert_allclose(wall.height(np.array([[0.2, 0, 0]])), 0.3, atol=0.005)


def test_wall_and_table_are_two() -> None:
    random = np.random.default_rng(2)
    table = _wall(random, -0.3, 0.4)[:, [1, 2, 0]]
    cameras = [look_at_origin("c", azimuth, 30.0, 64, 1.0) for azimuth in (-40, 0, 40)]
    walls = find_walls(np.concatenate([_head(random), _wall(random, -0.3, 0.5), table]), cameras, VOXEL, PARAMS)
    assert sorted(np.abs(wall.normal).argmax() for wall in walls) == [0, 2]


def test_a_head_alone_has_no_wall() -> None:
    assert find_walls(_head(np.random.default_rng(3), 12000), CAMERAS, VOXEL, PARAMS) == ()


def test_a_flat_chest_is_no_wall_since_the_head_goes_on_behind_it() -> None:
    random = np.random.default_rng(4)
    chest = _wall(random, 0.1, 0.3)
    chest[:, 2] -= 0.45
    assert find_walls(np.concatenate([_head(random), chest]), CAMERAS, VOXEL, PARAMS) == ()


def test_a_board_before_which_a_camera_does_not_stand_is_no_wall() -> None:
    random = np.random.default_rng(5)
    points = np.concatenate([_head(random), _wall(random, -0.1, 0.45)])
    behind = look_at_origin("b", 180, 0.0, 64, 1.0)
    assert find_walls(points, [*CAMERAS, behind], VOXEL, PARAMS) == ()


def test_few_points_or_points_on_a_line_are_no_wall() -> None:
    line = np.outer(np.linspace(-0.4, 0.4, 5000), [0.0, 1.0, 0.0])
    assert find_walls(line, CAMERAS, VOXEL, PARAMS) == ()
    assert find_walls(line[:10], CAMERAS, VOXEL, PARAMS) == ()
