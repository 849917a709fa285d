"""params.yaml: read, checked, overrides merged into the stages' sections, and these written for the stages."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from facefolds_core.errors import UserError
from facefolds_core.files import write_json
from facefolds_core.params import STAGE_SECTIONS, Overrides, Section, Subject, merged, section_of, user_error


class Params(Section):
    """All of params.yaml.

    Attributes:
        subjects: name -> subject.
        sections: stage -> its section as given (defaults are filled in by `stage`).
    """

    subjects: dict[str, Subject]
    sections: dict[str, dict[str, Any]]
    path: str

    def subject(self, name: str) -> Subject:
        if name not in self.subjects:
            raise UserError(
                f"no subject named {name!r}",
                file=self.path,
                place="subjects",
                expected=", ".join(sorted(self.subjects)),
                found=name,
                remedy="add it under `subjects` (docs/subjects.md), or name one that is there",
            )
        return self.subjects[name]

    def stage(self, stage: str, subject: str) -> Section:
        """The section of `stage` for `subject`: params.yaml's values, then the subject's overrides."""
        overrides: dict[str, Any] = getattr(self.subject(subject), stage)
        values = merged(self.sections.get(stage, {}), overrides)
        place = f"{stage} (for subject {subject})" if overrides else stage
        return section_of(stage, values, self.path, place)


class _Loader(yaml.SafeLoader):
    """PyYAML follows YAML 1.1, in which 1e-3 is a string; DVC writes YAML 1.2, in which it is a number."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(?:[0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def _subject(name: str, entry: Any, path: Path) -> Subject:
    try:
        return Subject.model_validate(entry)
    except ValidationError as error:
        raise user_error(error, (Subject,), path, f"subjects.{name}") from None


def load_params(path: str | Path = "params.yaml") -> Params:
    """Read and check params.yaml, every subject's merged sections included.

    Raises:
        UserError: if the file is missing, is not YAML, or a key or value is wrong; names the line or the key.
    """
    path = Path(path)
    try:
        value = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except FileNotFoundError:
        raise UserError(
            "file not found", file=path, remedy="run the command in the project's root folder, which has params.yaml"
        ) from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else f"line {mark.line + 1}, column {mark.column + 1}"
        found = getattr(error, "problem", None) or str(error)
        raise UserError(
            "garbled YAML", file=path, place=place, expected="valid YAML", found=found, remedy="mend this line"
        ) from None
    if not isinstance(value, dict) or not isinstance(value.get("subjects"), dict) or not value["subjects"]:
        raise UserError(
            "no subjects", file=path, expected="a mapping with a `subjects` section", remedy="see docs/subjects.md"
        )
    unknown = sorted(set(value) - {"subjects"} - set(STAGE_SECTIONS))
    if unknown:
        raise UserError(
            "unknown sections",
            file=path,
            place=", ".join(map(str, unknown)),
            expected=", ".join(["subjects", *STAGE_SECTIONS]),
            remedy="remove or rename them",
        )
    sections = {name: value.get(name) or {} for name in STAGE_SECTIONS}
    for name, section in sections.items():
        if not isinstance(section, dict):
            raise UserError(
                "not a section",
                file=path,
                place=name,
                expected="keys and values",
                found=repr(section),
                remedy=f"write `{name}: {{key: value}}`",
            )
    subjects = {str(name): _subject(str(name), entry, path) for name, entry in value["subjects"].items()}
    params = Params(subjects=subjects, sections=sections, path=str(path))
    for name in subjects:
        for stage in STAGE_SECTIONS:
            params.stage(stage, name)
    return params


def write_configs(params: Params, subject: str, folder: Path) -> list[Path]:
    """Write `subject.json` and one file for each stage; returns their paths."""
    core = params.subject(subject).model_dump(mode="json", exclude=set(Overrides.model_fields))
    values = {"subject": core}
    values |= {stage: params.stage(stage, subject).model_dump(mode="json") for stage in STAGE_SECTIONS}
    for name, value in values.items():
        write_json(folder / f"{name}.json", value)
    return [folder / f"{name}.json" for name in values]
