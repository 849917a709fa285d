"""docs/reference/params.md: all keys of params.yaml: types, bounds, defaults, descriptions, from the sections.

python -m docs.tools.params_page    # writes it; a test compares
"""

from __future__ import annotations

import json
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from facefolds_core.params.base import Section
from facefolds_core.params.sections import SECTIONS, section_in
from facefolds_core.params.subject import Overrides, Subject
from facefolds_core.params.train import PRESETS

PAGE = Path("docs/reference/params.md")

FIRST = {
    "normalize": ("long_side", "short_side", "max_azimuth", "max_elevation", "stabilize"),
    "subject": ("iterations",),
    "train": (
        "preset",
        "seed",
        "layers",
        "iterations",
        "reflection.begin",
        "segments.joint_frames",
        "segments.memory_megabytes",
    ),
    "sample": ("resolution",),
    "decimate": ("resolution",),
    "texture": ("resolution",),
    "bake": ("hold",),
    "compress": (
        "mesh.max_error_pixels",
        "video.codec",
        "video.target_psnr",
        "video.preset",
        "photos",
        "stream.beyond",
    ),
}
"""Stage -> the keys that people turn: they stand first, and not again among the expert keys."""

HEAD = """\
# Parameters

All keys of params.yaml, made from facefolds_core/params by `python -m docs.tools.params_page`.
Every section of a stage can be overridden for one subject, key by key ([subjects](../guide/subjects.md)).
Unknown keys, wrong types and numbers out of bounds are refused.
Lengths are in units of the scene: cameras are about 1 away from the subject.

Kinds of values: a *share* is a number from 0 to 1, a *part* the same but not 0; a *count* is an integer from 1, a
*natural* one from 0; a *weight* is a number from 0; *factor*, *rate* and *length* are numbers above 0.

Each key can be set for one run, and for sweeps, by its path; `++` adds it where params.yaml does not write it:

```
dvc exp run -S '++train.textures.smooth_every=5'                 # of a section
dvc exp run -S '++subjects.actor.train.textures.smooth_every=5'  # of one subject
dvc exp run --queue -S '++train.textures.smooth_every=3,4,5'     # a sweep: one experiment each
```
"""


KINDS = {
    "number ≥0, ≤1": "share",
    "number >0, ≤1": "part",
    "integer ≥1, ≤1e+08": "count",
    "integer ≥0, ≤1e+08": "natural",
    "number ≥0, ≤1e+06": "weight",
    "number >0, ≤1e+06": "factor",
    "number >0, ≤10": "length",
    "number >0, ≤1000": "rate",
}
"""Values with bounds that many keys have -> their name in the tables."""

EXPERT = """\
## Expert keys

Few users need what follows: every other key, by section.
"""


def page() -> str:
    """The whole page, Markdown."""
    parts = [HEAD, "## `subjects.NAME`\n", _table(Subject, "", set(Overrides.model_fields))]
    parts += ["## The keys that people turn\n", _rows(_first_keys()), EXPERT]
    seen: dict[type[Section], str] = {}
    for stage, kinds in SECTIONS.items():
        for kind in kinds:
            model = kind.model_fields["model"].default if len(kinds) > 1 else None
            parts.append(f"## `{stage}`" + (f", model `{model}`" if model else "") + "\n")
            parts.append(_words(kind.__doc__) + "\n")
            if model:
                parts.append(_presets(model))
            if kind is not kinds[0]:
                parts.append(_alike(kind, kinds[0]))
            parts += _tables(kind, stage, seen)
    return "\n".join(parts)


def _tables(kind: type[Section], path: str, seen: dict[type[Section], str]) -> Iterator[str]:
    """A table of a section's own keys, then one of each section in it; `seen` has the places of earlier tables."""
    stage, _, folder = path.partition(".")
    first = {key for key in FIRST.get(stage, ()) if _holder(stage, key) is kind and key.rpartition(".")[0] == folder}
    yield _table(kind, path, {key.rpartition(".")[2] for key in first} | _shared(kind))
    for name, field in kind.model_fields.items():
        inner = section_in(field.annotation)
        if inner is not None:
            yield f"### `{path}.{name}`{' (a list of these)' if get_origin(field.annotation) is tuple else ''}\n"
            if inner in seen:
                yield f"The keys of `{seen[inner]}`.\n"
                continue
            seen[inner] = f"{path}.{name}"
            yield _words(inner.__doc__) + "\n"
            yield from _tables(inner, f"{path}.{name}", seen)


def _shared(kind: type[Section]) -> set[str]:
    """Keys of a model that stand elsewhere: `model` follows from the preset, others are those of the first model."""
    models = SECTIONS["train"]
    if kind not in models:
        return set()
    return {"model"} | (set(kind.model_fields) & set(models[0].model_fields) if kind is not models[0] else set())


def _table(kind: type[Section], path: str, hidden: set[str]) -> str:
    return _rows(
        (field.alias or name, field)
        for name, field in kind.model_fields.items()
        if name not in hidden and not (path and isinstance(field.default, Section))
    )


def _rows(keys: Iterable[tuple[str, FieldInfo]]) -> str:
    rows = [f"|`{name}`|{_kind(field)}|{_default(field)}|{_words(field.description)}|" for name, field in keys]
    return "\n".join(["|key|values|default|meaning|", "|---|---|---|---|", *rows, ""]) if rows else ""


def _holder(stage: str, key: str) -> type[Section]:
    """The section that holds a key of FIRST; of `train`, the explicit model's."""
    kind = SECTIONS[stage][0]
    for name in key.split(".")[:-1]:
        kind = section_in(kind.model_fields[name].annotation) or kind
    return kind


def _first_keys() -> Iterator[tuple[str, FieldInfo]]:
    for stage, keys in FIRST.items():
        for key in keys:
            yield f"{stage}.{key}", _holder(stage, key).model_fields[key.rpartition(".")[2]]


def _presets(model: str) -> str:
    lines = []
    for name, preset in PRESETS.items():
        if preset.model == model:
            values = ", ".join(f"`{key}: {json.dumps(value)}`" for key, value in preset.values.items())
            lines.append(f"- Preset `{name}`: " + (f"the defaults but {values}." if values else "the defaults."))
    return "\n".join([*lines, ""])


def _alike(kind: type[Section], first: type[Section]) -> str:
    """A line on the keys that a model has in common with the first."""
    names = [name for name in kind.model_fields if name in first.model_fields and name not in ("model", "preset")]
    keys = ", ".join(f"`{name}` ({json.dumps(kind.model_fields[name].default)})" for name in names)
    return f"It has these keys in common with the model above; its defaults are in brackets: {keys}.\n"


def _kind(field: FieldInfo) -> str:
    bounds = [text for part in field.metadata if (text := _bound(part))]
    kind = _type(field.annotation) + (" " + ", ".join(bounds) if bounds else "")
    return KINDS.get(kind, kind)


def _type(annotation: Any) -> str:
    if hasattr(annotation, "__metadata__"):
        return _type(get_args(annotation)[0])
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in parts)
    if origin in (Union, types.UnionType):
        return " or ".join(_type(part) for part in parts)
    if origin is tuple:
        return f"list of {_type(parts[0])}" if parts[-1] is ... else f"[{', '.join(_type(part) for part in parts)}]"
    if origin is dict or annotation is dict:
        return "keys and values"
    names = {int: "integer", float: "number", str: "text", bool: "true, false", type(None): "null"}
    return names.get(annotation) or f"{{{', '.join(annotation.model_fields)}}}"


def _bound(part: Any) -> str:
    signs = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}
    return ", ".join(f"{sign}{getattr(part, name):g}" for name, sign in signs.items() if hasattr(part, name))


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default
    if value is PydanticUndefined:
        return "`{}`"
    if isinstance(value, Section):
        return f"`{value.model_dump_json()}`"
    if isinstance(value, tuple):
        value = [item.model_dump() if isinstance(item, Section) else item for item in value]
    return f"`{json.dumps(round(value, 6) if isinstance(value, float) else value)}`"


def _words(text: str | None) -> str:
    return " ".join((text or "").split()).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
