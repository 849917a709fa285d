"""Every model has keys, a trainer, a fitter, a description on disk, and a preset."""

from __future__ import annotations

from typing import get_args

from facefolds_core.model.storage import BUILDERS, ExplicitSpec, ModelSpec
from facefolds_core.params import PRESETS, TrainParams
from facefolds_core.training.models import FITTERS, TRAINERS


def test_every_model_is_everywhere() -> None:
    models = {kind.model_fields["model"].default for kind in get_args(TrainParams)}
    assert models == set(TRAINERS) == set(FITTERS) == set(BUILDERS) == {preset.model for preset in PRESETS.values()}
    assert models == {spec.model_fields["kind"].default for spec in (ExplicitSpec, ModelSpec)}
