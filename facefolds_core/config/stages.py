"""The files through which parameters reach the stages: reading them.

The stage `configure` (`params_file.write_configs`) splits params.yaml into one small file a stage,
`data/.config/<subject>/<stage>.json`, with the subject's overrides merged in. Each stage depends on its own file only,
so a change of one section (or of one subject's override) reruns what it must and nothing else.
"""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from facefolds_core.errors import UserError
from facefolds_core.files.parsing import brief, parse_json
from facefolds_core.files.reading import read_text
from facefolds_core.params import SECTIONS, Section, Subject, TrainParams, TrainSection

S = TypeVar("S", bound=Section)
T = TypeVar("T")
_REMEDY = "run `dvc repro`, which writes it from params.yaml"


def _read(adapter: TypeAdapter[T], path: Path) -> T:
    text = read_text(path, _REMEDY, expected="JSON")
    try:
        parse_json(text, path, _REMEDY)
        return adapter.validate_json(text)
    except ValidationError as error:
        raise UserError(
            "garbled stage configuration", file=path, found=brief(str(error), 500), remedy=_REMEDY
        ) from None


def read_subject(folder: Path) -> Subject:
    """The subject's own keys (without overrides)."""
    return _read(TypeAdapter(Subject), folder / "entry.json")


def read_stage(kind: type[S], folder: Path) -> S:
    """The section of one stage by its class: `read_stage(TextureParams, folders.config)`. `train` has `read_train`."""
    name = next(name for name, kinds in SECTIONS.items() if kinds == (kind,))
    return _read(TypeAdapter(kind), folder / f"{name}.json")


def read_train(folder: Path) -> TrainParams:
    """The section `train`, of whichever model it is."""
    return _read(TypeAdapter[TrainParams](TrainSection), folder / "train.json")


class LevelResolutions(Section):
    """`levels.json`: what `decimate` needs to know of the coarser levels of detail (`compress.levels`)."""

    mesh_resolutions: tuple[int, ...]
    """R^m of each, no number twice."""


def read_level_resolutions(folder: Path) -> tuple[int, ...]:
    """R^m of the coarser levels of detail, each once."""
    return _read(TypeAdapter(LevelResolutions), folder / "levels.json").mesh_resolutions
