"""All sections by their names, and raw values checked against them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, cast, get_args, get_origin

from pydantic import BaseModel, TypeAdapter, ValidationError

from facefolds_core.errors import UserError
from facefolds_core.files.parsing import brief
from facefolds_core.params.base import Section
from facefolds_core.params.capture import CaptureParams, NormalizeParams, SubjectParams
from facefolds_core.params.compress import CompressParams
from facefolds_core.params.evaluate import EvaluateParams
from facefolds_core.params.export import BakeParams, DecimateParams, ReconstructParams, SampleParams, TextureParams
from facefolds_core.params.renamed import remedy_for
from facefolds_core.params.train import PRESETS, TrainParams, TrainSection

SECTIONS: dict[str, tuple[type[Section], ...]] = {
    "capture": (CaptureParams,),
    "normalize": (NormalizeParams,),
    "subject": (SubjectParams,),
    "train": get_args(TrainParams),
    "sample": (SampleParams,),
    "reconstruct": (ReconstructParams,),
    "decimate": (DecimateParams,),
    "texture": (TextureParams,),
    "bake": (BakeParams,),
    "compress": (CompressParams,),
    "evaluate": (EvaluateParams,),
}
"""Stage -> its section's class; several of `train`, told apart by `model`."""

STAGE_SECTIONS = tuple(SECTIONS)

_TRAIN: TypeAdapter[TrainParams] = TypeAdapter(TrainSection)
REFERENCE = "docs/reference/params.md"
_SHARED = "what stands in `train` holds for all subjects, so keys of one model belong to the subjects that use it"


def section_of(stage: str, value: Any, file: str | Path | None = None, place: str | None = None) -> Section:
    """A raw section, checked.

    Args:
        stage: its name.
        value: keys and values as read.
        file, place: for the message.

    Raises:
        UserError: naming the key, what it should be, and for an unknown one the keys that there are.
    """
    try:
        if stage == "train":
            return _TRAIN.validate_python(value)
        return SECTIONS[stage][0].model_validate(value)
    except ValidationError as error:
        raise user_error(error, SECTIONS[stage], file, place or stage) from None


def train_params(value: Mapping[str, Any]) -> TrainParams:
    """The section `train` from a preset and overrides.

    Raises:
        UserError: if a key or value is wrong.
    """
    return cast(TrainParams, section_of("train", dict(value)))


def user_error(
    error: ValidationError, kinds: tuple[type[BaseModel], ...], file: str | Path | None, place: str
) -> UserError:
    """pydantic's first complaint in our words."""
    first = error.errors()[0]
    names = [str(part) for part in first["loc"]]
    kind = kinds[0]
    if len(kinds) > 1 and names:
        # The place within a union begins with the value that tells its members apart.
        kind = next(k for k in kinds if k.model_fields["model"].default == names[0])
        names = names[1:]
    remedy = f"mend it; {REFERENCE} describes all keys"
    expected, found = first["msg"].removeprefix("Value error, "), brief(first["input"])
    if first["type"] == "extra_forbidden":
        expected, mending = _unknown_key(kind, names)
        remedy = mending or remedy
        found = brief(names[-1]) if len(names[-1]) > 100 else names[-1]
    where = ".".join([place, *names])
    return UserError("a parameter is wrong", file=file, place=where, expected=expected, found=found, remedy=remedy)


def _unknown_key(kind: type[BaseModel], names: list[str]) -> tuple[str, str | None]:
    """What is expected instead of an unknown key, and what to do about one that was replaced or is of another model."""
    *folders, key = names
    holder = kind
    for name in folders:
        field = holder.model_fields.get(name)  # none for a position in a list
        holder = (field and section_in(field.annotation)) or holder
    keys = ", ".join(sorted(field.alias or name for name, field in holder.model_fields.items()))
    model = kind.model_fields["model"].default if "model" in kind.model_fields else None
    owner = f" of the model `{model}`" if model else ""
    expected = f"a key{owner}{' in `' + '.'.join(folders) + '`' if folders else ''}: {keys}"
    stage = next((stage for stage, kinds in SECTIONS.items() if kind in kinds), "")
    path = ".".join([stage, *names] if stage else names)
    mending = remedy_for(path)
    if mending is not None:
        return expected, mending
    for other in SECTIONS["train"] if model and not folders else ():
        if key in other.model_fields:
            name = other.model_fields["model"].default
            presets = [preset for preset, one in PRESETS.items() if one.model == name]
            whose = f"preset{'s' * (len(presets) > 1)} {', '.join(presets)}"
            return expected, f"`{key}` is a key of the model `{name}` ({whose}): remove it; {_SHARED}"
    return expected, None


def section_in(annotation: Any) -> type[Section] | None:
    """The section that a key holds, alone, in a list, or as one of several kinds of values; None if it holds none."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    if get_origin(annotation) in (tuple, Union, UnionType, Annotated):
        return next(filter(None, map(section_in, get_args(annotation))), None)
    return None
