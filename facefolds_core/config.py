"""The files through which parameters reach the stages: reading them.

The stage `configure` (`params_file.write_configs`) splits params.yaml into one small file a stage,
`data/.config/<subject>/<stage>.json`, with the subject's overrides merged in. Each stage depends on its own file only,
so a change of one section (or of one subject's override) reruns what it must and nothing else.
"""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from facefolds_core.errors import UserError
from facefolds_core.params import STAGE_SECTIONS, Section, Subject
from facefolds_core.parsing import brief, parse_json
from facefolds_core.reading import read_text

S = TypeVar("S", bound=Section)
_REMEDY = "run `dvc repro`, which writes it from params.yaml"


def _read(kind: type[S], path: Path) -> S:
    text = read_text(path, _REMEDY, expected="JSON")
    try:
        parse_json(text, path, _REMEDY)
        return kind.model_validate_json(text)
    except ValidationError as error:
        raise UserError(
            "garbled stage configuration", file=path, found=brief(str(error), 500), remedy=_REMEDY
        ) from None


def read_subject(folder: Path) -> Subject:
    """The subject's own keys (without overrides)."""
    return _read(Subject, folder / "subject.json")


def read_stage(kind: type[S], folder: Path) -> S:
    """The section of one stage, by its class: `read_stage(TrainParams, folders.config)`."""
    name = next(name for name, section in STAGE_SECTIONS.items() if section is kind)
    return _read(kind, folder / f"{name}.json")
