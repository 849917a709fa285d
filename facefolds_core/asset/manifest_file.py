"""manifest.json as a file: read and checked, written with its own checksum; and its JSON schema.

manifest.schema.json beside this file says what the models of `manifest.py` say, without our code; a test keeps the two
in step.
"""

from __future__ import annotations

import hashlib
import json
import re
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from facefolds_core.asset.manifest import FORMAT_VERSION, LEAST_VERSION, REMEDY, UNSEALED, Manifest
from facefolds_core.asset.manifest_base import without_absent
from facefolds_core.asset.stored import MISSING, special_problem
from facefolds_core.errors import UserError
from facefolds_core.files.writing import read_json, write_json, write_text

MANIFEST_NAME = "manifest.json"
SCHEMA_PATH = Path(__file__).with_name("manifest.schema.json")

SCHEMA_ID = f"urn:facefolds:asset:{FORMAT_VERSION}:manifest"

LARGEST = 1 << 24
"""Bytes of a manifest: one has some kB a level, and 200 bytes a segment."""

_SEAL = re.compile(rb'"manifest_sha256"\s*:\s*"([0-9a-f]{64})"')


def manifest_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of `Manifest`; keys with a default are required all the same in a file."""
    schema = Manifest.model_json_schema(mode="serialization")
    without_absent(schema)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA_ID}
    return {**head, "title": f"facefolds asset, version {FORMAT_VERSION}"} | schema


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
    wrong = partial(UserError, file=path, remedy=REMEDY)
    problem = special_problem(path)
    if problem is None and path.stat().st_size > LARGEST:
        problem = f"the file has {path.stat().st_size} bytes, a manifest at most {LARGEST}"
    if problem not in (None, MISSING):
        raise wrong("the manifest cannot be read", found=problem)
    value = read_json(path, remedy=REMEDY)
    if not isinstance(value, dict) or value.get("format") != "facefolds":
        found = value.get("format") if isinstance(value, dict) else type(value).__name__
        message = "not the manifest of a facefolds asset"
        raise wrong(message, place="format", expected="facefolds", found=_shown(found))
    _check_version(path, value)
    return _validated(path, value)


def _check_version(path: Path, value: dict[str, Any]) -> None:
    """Refuse what is not for this reader.

    Raises:
        UserError: if it is of an older version, needs a newer reader, or an extension: none is known here.
    """
    version, least = value.get("version"), value.get("minVersion")
    if not isinstance(version, int) or isinstance(version, bool) or version < FORMAT_VERSION:
        least = None
    elif version == FORMAT_VERSION:
        least = LEAST_VERSION  # a wrong one is said with the other keys
    if not isinstance(least, int) or isinstance(least, bool) or least > FORMAT_VERSION:
        raise UserError(
            "an asset of another format version",
            file=path,
            place="version",
            expected=FORMAT_VERSION,
            found=_shown(version),
            remedy="make the asset again with this version of facefolds, or read it with the one that made it",
        )
    required = value.get("extensionsRequired")
    if isinstance(required, list) and required:
        raise UserError(
            "the asset needs an extension of the format that this facefolds does not know",
            file=path,
            place="extensionsRequired",
            found=_shown(required[0]),
            remedy="read it with the program that made it",
        )


def _validated(path: Path, value: dict[str, Any]) -> Manifest:
    wrong = partial(UserError, file=path, remedy=REMEDY)
    newer = value["version"] != FORMAT_VERSION
    if newer:
        value = {**value, "version": FORMAT_VERSION, "minVersion": LEAST_VERSION}
    try:
        try:
            manifest = Manifest.model_validate_json(json.dumps(value))
        except ValidationError as error:
            unknown = [one["loc"] for one in error.errors() if one["type"] == "extra_forbidden"]
            if not newer or not unknown:
                raise
            manifest = Manifest.model_validate_json(json.dumps(_without(value, unknown)))
        missing = _missing_keys(manifest.model_dump(mode="json"), value)
    except ValidationError as error:
        first = error.errors()[0]
        place, found = ".".join(str(part) for part in first["loc"]), repr(first["input"])[:200]
        raise wrong("the manifest is wrong", place=place, expected=first["msg"], found=found) from None
    except (ValueError, RecursionError):  # pydantic: what lies too deep in extras
        raise wrong("the manifest is wrong", found="too deep") from None
    if missing:
        raise wrong("the manifest lacks keys", place=", ".join(missing))
    return manifest


def _without(value: dict[str, Any], places: list[tuple[int | str, ...]]) -> dict[str, Any]:
    """A copy without the keys at some places: what a newer version added and this one may pass over."""
    copied: dict[str, Any] = json.loads(json.dumps(value))
    for place in places:
        inner: Any = copied
        for key in place[:-1]:
            inner = inner[key]
        inner.pop(place[-1], None)
    return copied


def _shown(value: object) -> object:
    """A value as a message may show it: short, and without characters that steer terminals."""
    if isinstance(value, int | float | None) and abs(value or 0) < 1e9:
        return value
    text = str(value)[:200]
    return text if text.isprintable() else repr(text)


def _missing_keys(whole: Any, given: Any, place: str = "") -> list[str]:
    """Dotted names of the keys of `whole` that `given` lacks (and whose defaults filled the gap)."""
    if isinstance(whole, dict):
        whole = {key: inner for key, inner in whole.items() if key not in ("extensions", "extras")}
        found = [f"{place}{key}" for key in whole if key not in given]
        pairs = [(key, whole[key], given[key]) for key in whole if key in given]
    elif isinstance(whole, list):
        found, pairs = [], [(str(i), a, b) for i, (a, b) in enumerate(zip(whole, given, strict=True))]
    else:
        return []
    return found + [name for key, a, b in pairs for name in _missing_keys(a, b, f"{place}{key}.")]


def write_schema() -> None:
    """Write manifest.schema.json again, after a change of the models."""
    write_json(SCHEMA_PATH, manifest_schema())
