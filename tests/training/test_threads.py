"""Geometry is the same, bit for bit, on any number of torch's threads."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.trainer import Trainer


@pytest.fixture
def threads() -> Iterator[None]:
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def recentred(count: int) -> NDArray[np.float64]:
    """The middle radius after a round of geometry whose opacity is random."""
    torch.set_num_threads(count)
    draw = torch.Generator().manual_seed(0)
    texture = torch.rand(48 * 48, 3, 4, generator=draw)
    middle = np.full((384, 355), 0.3)
    trainer: Any = SimpleNamespace(
        state=SimpleNamespace(shape=(48, 48), activated=lambda k: texture, layers=torch.ones(3, 48 * 48, 3, 4)),
        scene=SimpleNamespace(num_frames=1),
        middle=middle,
        geometry=1.0,
        params=ExplicitParams(),
        fit=SimpleNamespace(
            middle=middle,
            trust=0 * middle,
            radii=lambda middle, apart: middle[..., None] + np.array([0.05, 0.0, -0.05]),
        ),
    )
    Trainer._recentre(cast(Trainer, trainer))
    return cast("NDArray[np.float64]", trainer.middle)


def test_layers_move_to_the_same_places_on_any_number_of_threads(threads: None) -> None:
    one = recentred(1)
    assert one.std() > 0
    for count in (2, 3, 4):
        np.testing.assert_array_equal(recentred(count), one)
