"""Ways to show a head at equal bytes: how each is scored and drawn, on pictures whose errors are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bench.equal_bytes import SHOWN, Look, picture, scores
from facefolds_core.scoring.backgrounds import Cutout

SIDE = 32
TRUTH = {(0, 0): Cutout(np.full((SIDE, SIDE, 3), 0.4), np.ones((SIDE, SIDE)), np.zeros((SIDE, SIDE, 3)))}
SCENE: Any = SimpleNamespace(camera_in_head=lambda index, frame: (index, frame))


def brighter_by(amount: float) -> Look:
    return lambda camera, frame: (np.full((SIDE, SIDE, 3), 0.4 + amount), np.ones((SIDE, SIDE)))


def test_scores_are_over_any_background_and_of_the_worst_patch() -> None:
    assert scores(brighter_by(51 / 255), SCENE, TRUTH) == ["14.0", "14.0"]
    assert scores(brighter_by(5 / 255), SCENE, TRUTH) == ["34.2", "34.2"]


def test_a_hole_costs_over_every_background() -> None:
    hole: Look = lambda camera, frame: (np.zeros((SIDE, SIDE, 3)), np.zeros((SIDE, SIDE)))  # noqa: E731
    expected = np.mean([(value - 0.4) ** 2 for value in (0.0, 1.0, 0.5, 0.0)])
    assert scores(hole, SCENE, TRUTH)[0] == f"{-10 * np.log10(expected):.1f}"


def test_the_picture_has_the_truth_first() -> None:
    drawn = picture([brighter_by(0.2), brighter_by(0.4)], SCENE, (0, 0), TRUTH[0, 0])
    assert drawn.size == (3 * SIDE * SHOWN, SIDE * SHOWN)
    middles = [drawn.getpixel(((i * SIDE + SIDE // 2) * SHOWN, SIDE)) for i in range(3)]
    assert middles == [(102,) * 3, (153,) * 3, (204,) * 3]
