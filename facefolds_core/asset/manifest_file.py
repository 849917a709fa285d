"""manifest.json as a file: read and checked, written with its own checksum; and its JSON schema.

manifest.schema.json beside this file says what the models of `manifest.py` say, without our code; a test keeps the two
in step.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from facefolds_core.asset.manifest import FORMAT_VERSION, REMEDY, UNSEALED, Manifest
from facefolds_core.asset.stored import MISSING, special_problem
from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_text

MANIFEST_NAME = "manifest.json"
SCHEMA_PATH = Path(__file__).with_name("manifest.schema.json")

LARGEST = 1 << 24
"""Bytes of a manifest: one has some kB a level."""

_SEAL = re.compile(rb'"manifest_sha256"\s*:\s*"([0-9a-f]{64})"')


def manifest_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of `Manifest`; keys with a default are required all the same in a file."""
    schema = Manifest.model_json_schema(mode="serialization")
    level, reflection = schema["$defs"]["Level"], {"$ref": "#/$defs/Reflection"}
    level["properties"]["reflection"] = reflection
    level["required"] = [key for key in level["required"] if key != "reflection"]
    poses = schema["properties"]["track"]["anyOf"][0]
    schema["properties"]["track"] = poses | {"title": "Track"}
    schema["properties"]["view"] = {"$ref": "#/$defs/FilmedView"}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "facefolds asset, version 2"} | schema


def sealed(manifest: Manifest) -> tuple[str, str]:
    """The text of the manifest's file, with its own checksum in it, and that checksum."""
    value = manifest.model_dump(mode="json") | {"manifest_sha256": UNSEALED}
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    digest = hashlib.sha256(text.encode()).hexdigest()
    return text.replace(f'"manifest_sha256": "{UNSEALED}"', f'"manifest_sha256": "{digest}"'), digest


def write_manifest(manifest: Manifest, path: Path) -> Manifest:
    """Write the manifest with its own checksum; returns it as written."""
    text, digest = sealed(manifest)
    write_text(path, text)
    return manifest.model_copy(update={"manifest_sha256": digest})


def seal_is_whole(raw: bytes) -> bool:
    """Whether the bytes of a manifest agree with the checksum that stands in them."""
    found = _SEAL.findall(raw)
    if len(found) != 1:
        return False
    digest: bytes = found[0]
    return hashlib.sha256(raw.replace(digest, UNSEALED.encode())).hexdigest() == digest.decode()


def parse_manifest(path: Path) -> Manifest:
    """Read and check a manifest by itself (not its checksum, and none of the files that it names).

    Raises:
        UserError: if it is missing, not JSON, not a facefolds asset, of another version, or a key is wrong.
    """
    problem = special_problem(path)
    if problem is None and path.stat().st_size > LARGEST:
        problem = f"the file has {path.stat().st_size} bytes, a manifest at most {LARGEST}"
    if problem not in (None, MISSING):
        raise UserError("the manifest cannot be read", file=path, found=problem, remedy=REMEDY)
    value = read_json(path, remedy=REMEDY)
    if not isinstance(value, dict) or value.get("format") != "facefolds":
        found = value.get("format") if isinstance(value, dict) else type(value).__name__
        raise UserError(
            "not the manifest of a facefolds asset",
            file=path,
            place="format",
            expected="facefolds",
            found=_shown(found),
            remedy=REMEDY,
        )
    if value.get("version") != FORMAT_VERSION or isinstance(value.get("version"), bool):
        raise UserError(
            "an asset of another format version",
            file=path,
            place="version",
            expected=FORMAT_VERSION,
            found=_shown(value.get("version")),
            remedy="make the asset again with this version of facefolds, or read it with the one that made it",
        )
    value = _without_view_effects(value)
    try:
        manifest = Manifest.model_validate_json(json.dumps(value))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UserError(
            "the manifest is wrong",
            file=path,
            place=place,
            expected=first["msg"],
            found=repr(first["input"])[:200],
            remedy=REMEDY,
        ) from None
    missing = _missing_keys(manifest.model_dump(mode="json"), value)
    if missing:
        raise UserError("the manifest lacks keys", file=path, place=", ".join(missing), remedy=REMEDY)
    return manifest


def _without_view_effects(value: dict[str, Any]) -> dict[str, Any]:
    """A manifest as it would be without what early writers of version 2 had in each level: `view_effects`, null or a
    picture with a place in it for each layer, which a player was always free to ignore."""
    levels = value.get("levels")
    return value | {"levels": [_level_without(one) for one in levels]} if isinstance(levels, list) else value


def _level_without(level: Any) -> Any:
    if not isinstance(level, dict) or "view_effects" not in level:
        return level
    kept = {key: part for key, part in level.items() if key != "view_effects"}
    effects, layers = level["view_effects"], level.get("layers")
    if isinstance(effects, dict) and isinstance(layers, list):
        kept["bytes"] = _difference(level.get("bytes"), effects.get("bytes"))
        kept["layers"] = [
            {key: part for key, part in layer.items() if key != "effects_rect"} if isinstance(layer, dict) else layer
            for layer in layers
        ]
    return kept


def _difference(whole: Any, part: Any) -> Any:
    return whole - part if isinstance(whole, int) and isinstance(part, int) else whole


def _shown(value: object) -> object:
    """A value as a message may show it: short, and without characters that steer terminals."""
    if isinstance(value, int | float | None) and abs(value or 0) < 1e9:
        return value
    text = str(value)[:200]
    return text if text.isprintable() else repr(text)


def _missing_keys(whole: Any, given: Any, place: str = "") -> list[str]:
    """Dotted names of the keys of `whole` that `given` lacks (and whose defaults filled the gap)."""
    if isinstance(whole, dict):
        found = [f"{place}{key}" for key in whole if key not in given]
        pairs = [(key, whole[key], given[key]) for key in whole if key in given]
    elif isinstance(whole, list):
        found, pairs = [], [(str(i), a, b) for i, (a, b) in enumerate(zip(whole, given, strict=True))]
    else:
        return []
    return found + [name for key, a, b in pairs for name in _missing_keys(a, b, f"{place}{key}.")]


def write_schema() -> None:
    """Write manifest.schema.json again, after a change of the models."""
    write_text(SCHEMA_PATH, json.dumps(manifest_schema(), indent=1) + "\n")
