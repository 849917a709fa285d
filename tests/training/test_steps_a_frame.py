"""Every frame gets its share of the steps, however many there are."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.plan import epochs, plan
from tests.training.test_warnings import WELL

PIXELS = 3_000_000
FITTED = replace(WELL, texels=(128, 96))


def params(steps: int = 20) -> ExplicitParams:
    return ExplicitParams.model_validate({"textures": {"steps_per_frame": steps}})


@pytest.mark.parametrize("frames", [1, 4, 6])
def test_few_frames_share_the_iterations_that_are_asked_for(frames: int) -> None:
    assert sum(level.iterations for level in plan(FITTED, params(), frames, PIXELS)) == params().iterations


@pytest.mark.parametrize(("frames", "steps"), [(24, 20), (200, 20), (1000, 20), (1000, 1)])
def test_each_of_many_frames_has_its_steps_at_full_resolution(frames: int, steps: int) -> None:
    last = plan(FITTED, params(steps), frames, PIXELS)[-1]
    order = epochs(frames, np.random.default_rng(0))
    taken = Counter(islice(order, last.iterations))
    assert last.texels == (128, 96)
    assert len(taken) == frames
    assert min(taken.values()) >= max(1, int(0.6 * steps))


def test_orders_differ_and_repeat_with_the_seed() -> None:
    first, again = (epochs(9, np.random.default_rng(3)) for _ in range(2))
    orders = [list(islice(first, 9)) for _ in range(2)]
    assert orders[0] != orders[1]
    assert sorted(orders[0]) == sorted(orders[1]) == list(range(9))
    assert orders == [list(islice(again, 9)) for _ in range(2)]


@pytest.mark.parametrize(("iterations", "pace"), [(183, 1.0), (460, 1.0), (740, 0.5), (1860, 1 / 6)])
def test_a_longer_training_goes_the_same_way_in_smaller_steps(iterations: int, pace: float) -> None:
    *rounds, half, last = plan(FITTED, params().model_copy(update={"iterations": iterations}), 1, PIXELS)
    assert all(level.pace == 1 for level in rounds)
    assert half.pace == last.pace == pytest.approx(pace)


def test_many_frames_are_trained_at_full_rate() -> None:
    assert {level.pace for level in plan(FITTED, params(), 200, PIXELS)} == {1.0}
    doubled = params().model_copy(update={"iterations": 8180})
    assert plan(FITTED, doubled, 200, PIXELS)[-1].pace == pytest.approx(0.5)


@pytest.mark.parametrize("parts", [1, 2, 4, 7])
def test_opacity_is_smoothed_as_often_in_a_longer_training(parts: int) -> None:
    level = replace(plan(FITTED, params(), 1, PIXELS)[-1], pace=1 / parts)
    smoothed = [i for i in range(168 * parts) if level.smooths(i, 3)]
    assert smoothed == [3 * parts * k for k in range(56)]


@pytest.mark.parametrize(("pixels", "stride"), [(3_000_000, 8), (2_000_000, 8), (1_440_000, 5), (540_672, 2), (100, 1)])
def test_rounds_look_at_enough_of_small_pictures(pixels: int, stride: int) -> None:
    *rounds, half, last = plan(FITTED, params(), 12, pixels)
    assert {level.stride for level in rounds} == {stride}
    assert half.stride == last.stride == 1
