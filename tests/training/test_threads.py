"""Geometry is the same, bit for bit, on any number of torch's threads."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import torch

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.trainer import Trainer


@pytest.fixture
def threads() -> Iterator[None]:
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def recentred(count: int) -> np.ndarray:
    """How far layers move after a round of geometry whose opacity is random."""
    torch.set_num_threads(count)
    draw = torch.Generator().manual_seed(0)
    texture = torch.rand(48 * 48, 3, 4, generator=draw)
    still = np.zeros((384, 355))
    trainer: Any = SimpleNamespace(
        state=SimpleNamespace(shape=(48, 48), activated=lambda k: texture, layers=torch.ones(3, 48 * 48, 3, 4)),
        scene=SimpleNamespace(num_frames=1),
        shift=still,
        distances=lambda: still[..., None] + np.array([0.05, 0.0, -0.05]),
        params=ExplicitParams(layers=3),
        fit=SimpleNamespace(trust=still),
    )
    Trainer._recentre(cast(Trainer, trainer))
    return cast(np.ndarray, trainer.shift)


def test_layers_move_to_the_same_places_on_any_number_of_threads(threads: None) -> None:
    one = recentred(1)
    assert one.std() > 0
    for count in (2, 3, 4):
        np.testing.assert_array_equal(recentred(count), one)
