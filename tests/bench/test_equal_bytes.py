"""Ways to show a head at equal bytes: how each is scored and drawn, on pictures whose errors are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bench.equal_bytes import Look, film, scores
from facefolds_core.scoring.backgrounds import Cutout

SIDE = 32
TRUTH = {(0, 0): Cutout(np.full((SIDE, SIDE, 3), 0.4), np.ones((SIDE, SIDE)), np.zeros((SIDE, SIDE, 3)))}
SCENE: Any = SimpleNamespace(camera_in_head=lambda index, frame: (index, frame))


def brighter_by(amount: float) -> Look:
    return lambda camera, frame: (np.full((SIDE, SIDE, 3), 0.4 + amount), np.ones((SIDE, SIDE)))


def test_scores_are_over_any_background_and_of_the_worst_patch() -> None:
    assert scores(brighter_by(51 / 255), SCENE, TRUTH) == ["14.0", "14.0"]
    assert scores(brighter_by(5 / 255), SCENE, TRUTH) == ["34.2", "34.2"]
    # A hole costs over every background.
    hole: Look = lambda camera, frame: (np.zeros((SIDE, SIDE, 3)), np.zeros((SIDE, SIDE)))  # noqa: E731
    expected = np.mean([(value - 0.4) ** 2 for value in (0.0, 1.0, 0.5, 0.0)])
    assert scores(hole, SCENE, TRUTH)[0] == f"{-10 * np.log10(expected):.1f}"


def test_the_film_plays_all_frames_side_by_side() -> None:
    dark: Look = lambda camera, frame: (np.full((16, 8, 3), 0.2), np.full((16, 8), 0.5))  # noqa: E731
    moving: Look = lambda camera, frame: (np.full((16, 8, 3), 0.2 * frame), np.ones((16, 8)))  # noqa: E731
    drawn = film([moving, dark], 3, 4, (8, 16))
    assert [picture.size for picture in drawn] == [(16, 16)] * 4
    assert [picture.getpixel((4, 8)) for picture in drawn] == [(value,) * 3 for value in (0, 51, 102, 0)]
    assert {picture.getpixel((12, 8)) for picture in drawn} == {(115,) * 3}
