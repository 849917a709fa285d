"""Every frame gets its share of the steps, however many there are."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.fit import Fit
from facefolds_core.training.explicit.plan import plan


def fitted() -> Fit:
    ones = np.ones((4, 4))
    return Fit(
        np.zeros(3), (-0.5, 0.5, -0.5, 0.5), ones, ones, ones, ones, np.ones((4, 4, 3)), (128, 96), (), (), {}, 30.0
    )


def params(steps: int = 20) -> ExplicitParams:
    return ExplicitParams.model_validate({"textures": {"steps_per_frame": steps}})


@pytest.mark.parametrize("frames", [1, 12, 14])
def test_few_frames_share_the_iterations_that_are_asked_for(frames: int) -> None:
    assert sum(level.iterations for level in plan(fitted(), params(), frames)) == params().iterations


@pytest.mark.parametrize(("frames", "steps"), [(24, 20), (200, 20), (1000, 1)])
def test_many_frames_have_their_steps_at_full_resolution(frames: int, steps: int) -> None:
    last = plan(fitted(), params(steps), frames)[-1]
    assert last.texels == (128, 96)
    assert last.iterations >= frames * max(1, int(0.6 * steps))
