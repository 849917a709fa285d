"""Every model has keys, presets, a description on disk, and what builds and trains it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import pytest

from facefolds_core.params import PRESETS, TrainParams
from facefolds_core.registry import MODELS, Registry
from facefolds_core.training import trainers


@pytest.mark.parametrize("name", MODELS.names)
def test_a_model_is_whole(name: str) -> None:
    model = MODELS[name]
    assert model.Params in get_args(TrainParams)
    assert model.Params.model_fields["model"].default == model.spec().model_fields["kind"].default == name
    assert {preset for preset, one in PRESETS.items() if one.model == name} == set(model.PRESETS) != set()
    assert callable(model.build) and callable(model.fit)


def test_a_model_without_files_of_its_own_is_written_by_its_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved: list[Path] = []
    trained = SimpleNamespace(save=saved.append, report="seconds")
    monkeypatch.setattr(Registry, "__getitem__", lambda *_: SimpleNamespace(fit=lambda *_: trained))
    params = SimpleNamespace(model="new")
    assert trainers.train(None, params, tmp_path, tmp_path, tmp_path) == "seconds"  # type: ignore[arg-type]
    assert saved == [tmp_path]
