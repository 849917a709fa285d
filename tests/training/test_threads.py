"""Geometry is the same, bit for bit, on any number of torch's threads."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest
import torch
from torch import Tensor

from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.trainer import Trainer


@pytest.fixture
def threads() -> Iterator[None]:
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def recentred(count: int) -> Tensor:
    """The middle radius after a round of geometry whose opacity is random."""
    torch.set_num_threads(count)
    draw = torch.Generator().manual_seed(0)
    texture = torch.rand(48 * 48, 3, 4, generator=draw)
    middle = torch.full((384, 355), 0.3)
    radii = middle[..., None] + torch.tensor([0.05, 0.0, -0.05])
    whole = torch.ones(384, 355, dtype=torch.float64).numpy()
    trainer: Any = SimpleNamespace(
        state=SimpleNamespace(shape=(48, 48), activated=lambda k: texture, layers=torch.ones(3, 48 * 48, 3, 4)),
        scene=SimpleNamespace(num_frames=1),
        middle=middle,
        manifolds=lambda: SimpleNamespace(radii=lambda: radii),
        params=ExplicitParams(),
        fit=SimpleNamespace(middle=0.3 * whole, halfwidth=0.05 * whole, reach=0 * whole, trust=0 * whole),
    )
    Trainer._recentre(cast(Trainer, trainer))
    return cast(Tensor, trainer.middle)


def test_layers_move_to_the_same_places_on_any_number_of_threads(threads: None) -> None:
    one = recentred(1)
    assert one.std() > 0
    for count in (2, 3, 4):
        assert torch.equal(recentred(count), one)
