"""Every frame gets its share of the steps, however many there are."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from facefolds_core.geometry.chart import Chart
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.fit import Fit
from facefolds_core.training.explicit.plan import Epochs, plan


def fitted() -> Fit:
    ones = np.ones((4, 4))
    return Fit(
        Chart((0, 0, 0)),
        (-0.5, 0.5, -0.5, 0.5),
        ones,
        ones,
        ones,
        ones,
        np.ones((4, 4, 3)),
        (128, 96),
        (),
        (),
        {},
        30.0,
    )


def params(steps: int = 20) -> ExplicitParams:
    return ExplicitParams.model_validate({"textures": {"steps_per_frame": steps}})


@pytest.mark.parametrize("frames", [1, 12, 14])
def test_few_frames_share_the_iterations_that_are_asked_for(frames: int) -> None:
    assert sum(level.iterations for level in plan(fitted(), params(), frames)) == params().iterations


@pytest.mark.parametrize(("frames", "steps"), [(24, 20), (200, 20), (1000, 20), (1000, 1)])
def test_each_of_many_frames_has_its_steps_at_full_resolution(frames: int, steps: int) -> None:
    last = plan(fitted(), params(steps), frames)[-1]
    epochs = Epochs(frames, np.random.default_rng(0))
    taken = Counter(epochs.next() for _ in range(last.iterations))
    assert last.texels == (128, 96)
    assert len(taken) == frames
    assert min(taken.values()) >= max(1, int(0.6 * steps))


def test_orders_differ_and_repeat_with_the_seed() -> None:
    first, again = (Epochs(9, np.random.default_rng(3)) for _ in range(2))
    orders = [[first.next() for _ in range(9)] for _ in range(2)]
    assert orders[0] != orders[1]
    assert sorted(orders[0]) == sorted(orders[1]) == list(range(9))
    assert orders == [[again.next() for _ in range(9)] for _ in range(2)]
