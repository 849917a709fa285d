"""`train`: one of the models (facefolds_core/training/trainers), told apart by the preset, each with its own keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import BeforeValidator, Field

from facefolds_core.params.base import merged
from facefolds_core.registry import MODELS

if TYPE_CHECKING:
    from facefolds_core.params.explicit import ExplicitParams
    from facefolds_core.params.mlp import MlpParams

    TrainParams = ExplicitParams | MlpParams
else:
    TrainParams = Union[tuple(MODELS[name].Params for name in MODELS.names)]  # noqa: UP007


@dataclass(frozen=True)
class Preset:
    """A named set of values.

    Attributes:
        model: whose keys they are.
        values: that differ from the model's defaults.
    """

    model: str
    values: Mapping[str, Any] = field(default_factory=dict)


DEFAULT_PRESET = "fast"

PRESETS: dict[str, Preset] = {
    preset: Preset(model, values) for model in MODELS.names for preset, values in MODELS[model].PRESETS.items()
}


def filled(value: Any) -> Any:
    """A raw section with its preset's values for the keys that are not given; its model is the preset's.

    Raises:
        ValueError: if there is no such preset, or another model is asked for.
    """
    if not isinstance(value, dict):
        return value
    name = value.get("preset", DEFAULT_PRESET)
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"unknown preset {name!r}; there are {', '.join(sorted(PRESETS))}")
    preset = PRESETS[name]
    if value.get("model", preset.model) != preset.model:
        raise ValueError(
            f"the preset {name!r} is one of the model {preset.model!r}, not of {value['model']!r}; leave `model` out"
        )
    return merged({**preset.values, "preset": name, "model": preset.model}, value)


TrainSection = Annotated[
    Annotated[TrainParams, Field(discriminator="model")],
    BeforeValidator(filled),
]
"""The section as it stands in params.yaml."""
