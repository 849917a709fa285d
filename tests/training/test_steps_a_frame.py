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


@pytest.mark.parametrize(("pixels", "stride"), [(3_000_000, 8), (2_000_000, 8), (1_440_000, 5), (540_672, 2), (100, 1)])
def test_rounds_look_at_enough_of_small_pictures(pixels: int, stride: int) -> None:
    *rounds, half, last = plan(FITTED, params(), 12, pixels)
    assert {level.stride for level in rounds} == {stride}
    assert half.stride == last.stride == 1
