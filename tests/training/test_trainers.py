"""Every model has keys, presets, a description on disk, and what builds and trains it."""

from __future__ import annotations

from typing import get_args

import pytest

from facefolds_core.params import PRESETS, TrainParams
from facefolds_core.registry import MODELS


@pytest.mark.parametrize("name", MODELS.names)
def test_a_model_is_whole(name: str) -> None:
    model = MODELS[name]
    assert model.Params in get_args(TrainParams)
    assert model.Params.model_fields["model"].default == model.spec().model_fields["kind"].default == name
    assert {preset for preset, one in PRESETS.items() if one.model == name} == set(model.PRESETS) != set()
    assert callable(model.build) and callable(model.train)
