"""params.yaml: read, checked, overrides merged into the stages' sections, and these written for the stages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from facefolds_core.errors import UserError
from facefolds_core.files.parsing import brief, parse_yaml
from facefolds_core.files.paths import check_path_text, check_subject_name
from facefolds_core.files.reading import is_there, read_text
from facefolds_core.files.writing import write_json
from facefolds_core.params import STAGE_SECTIONS, Overrides, Section, Subject, merged, section_of, user_error
from facefolds_core.params.renamed import remedy_for


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
                remedy="add it under `subjects` (docs/guide/subjects.md), or name one that is there",
            )
        return self.subjects[name]

    def stage(self, stage: str, subject: str) -> Section:
        """The section of `stage` for `subject`: params.yaml's values, then the subject's overrides."""
        overrides: dict[str, Any] = getattr(self.subject(subject), stage)
        values = merged(self.sections.get(stage, {}), overrides)
        place = f"{stage} (for subject {subject})" if overrides else stage
        return section_of(stage, values, self.path, place)


def _subject(name: str, entry: Any, path: Path) -> Subject:
    try:
        return Subject.model_validate(entry)
    except ValidationError as error:
        raise user_error(error, (Subject,), path, f"subjects.{name}") from None


def load_params(path: str | Path = "params.yaml") -> Params:
    """Read and check params.yaml, every subject's merged sections included.

    Raises:
        UserError: if the file is missing, is not YAML (parsing.py), or a name, key or value is wrong; names the line
            or the key.
    """
    path = Path(path)
    here = "run the command in the project's root folder, which has params.yaml"
    text = read_text(path, here if not is_there(path) else "save it as UTF-8", expected="YAML")
    return params_from(parse_yaml(text, path, "mend it; docs/guide/subjects.md describes the file"), path)


def params_from(value: Any, path: Path) -> Params:
    """What a params.yaml holds, checked; raises as `load_params` does.

    Args:
        path: for the message.
    """
    if not isinstance(value, dict) or not isinstance(value.get("subjects"), dict) or not value["subjects"]:
        raise UserError(
            "no subjects",
            file=path,
            expected="a mapping with a `subjects` section",
            remedy="see docs/guide/subjects.md",
        )
    unknown = [name for name in value if name not in ("subjects", *STAGE_SECTIONS)]
    if unknown:
        raise UserError(
            "unknown sections",
            file=path,
            place=brief(", ".join(brief(name) for name in unknown), 200),
            expected=", ".join(["subjects", *STAGE_SECTIONS]),
            remedy=next(filter(None, map(remedy_for, map(str, unknown))), "remove or rename them"),
        )
    sections = {name: value.get(name) or {} for name in STAGE_SECTIONS}
    for name, section in sections.items():
        if not isinstance(section, dict):
            raise UserError(
                "not a section",
                file=path,
                place=name,
                expected="keys and values",
                found=brief(section),
                remedy=f"write `{name}: {{key: value}}`",
            )
    for name in value["subjects"]:
        check_subject_name(name, path)
    subjects = {name: _subject(name, entry, path) for name, entry in value["subjects"].items()}
    for name, subject in subjects.items():
        for key in ("path", "mattes", "start"):
            if (given := getattr(subject, key)) is not None:
                check_path_text(given, name, path, key)
    params = Params(subjects=subjects, sections=sections, path=str(path))
    for name in subjects:
        for stage in STAGE_SECTIONS:
            params.stage(stage, name)
    return params


def write_configs(params: Params, subject: str, folder: Path) -> list[Path]:
    """Write `entry.json`, one file a stage, `levels.json` (see `config`); returns their paths."""
    core = params.subject(subject).model_dump(mode="json", by_alias=True, exclude=set(Overrides.model_fields))
    write_json(folder / "entry.json", core)
    written = [write_section(stage, params.stage(stage, subject), folder) for stage in STAGE_SECTIONS]
    return [folder / "entry.json", *(path for paths in written for path in paths)]


def write_section(stage: str, section: Section, folder: Path) -> list[Path]:
    """Write one stage's file, and what other stages need to know of it; returns their paths."""
    value = section.model_dump(mode="json")
    values: dict[str, Any] = {stage: value}
    if stage == "compress":
        resolutions = sorted({level["mesh_resolution"] for level in value["levels"]})
        values["levels"] = {"mesh_resolutions": resolutions}
    for name, content in values.items():
        write_json(folder / f"{name}.json", content)
    return [folder / f"{name}.json" for name in values]
