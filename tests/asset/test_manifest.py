"""The manifest and its JSON schema say the same."""

from __future__ import annotations

import copy
import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from facefolds_core import __version__
from facefolds_core.asset.manifest_file import SCHEMA_PATH, manifest_schema, parse_manifest, seal_is_whole
from facefolds_core.errors import UserError
from tests.assets import make_asset


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("manifest") / "asset"
    make_asset(folder, frames=1)
    return folder / "manifest.json"


def test_schema_file_is_in_step() -> None:
    # If this fails: call facefolds_core.asset.manifest.write_schema()
    assert json.loads(SCHEMA_PATH.read_text()) == manifest_schema()


def test_schema_is_valid_and_accepts_a_manifest(path: Path) -> None:
    schema = json.loads(SCHEMA_PATH.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(json.loads(path.read_text()))


RECTS = ("environment_rect", "gloss_rect", "offset_rect", "normals_rect")
REFLECTION: dict[str, Any] = {
    "file": "full_reflection.png",
    "bytes": 9,
    "sha256": "0" * 64,
    "width": 4,
    "height": 16,
    "uv_window": [-1.0, 1.0, -1.0, 1.0],
    **{name: [0, 4 * i, 4, 4] for i, name in enumerate(RECTS)},
    **{f"{name}_scale": 0.5 for name in ("environment", "gloss", "offset")},
}


LACKING = object()
"""In place of a new value: the key is left out."""


def broken(value: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Manifests that break one rule each."""
    edits: dict[str, tuple[list[Any], Any]] = {
        "format": (["format"], "gltf"),
        "version": (["version"], "3"),
        "no such version": (["version"], 0),
        "minVersion": (["minVersion"], 4),
        "no name": (["extensionsUsed"], [""]),
        "null": (["extras"], None),
        "extension": (["levels", 0, "extensions"], {"A": 1}),
        "no levels": (["levels"], []),
        "level name": (["levels", 0, "name"], "Full"),
        "no layers": (["levels", 0, "layers"], []),
        "no videos": (["levels", 0, "texture", "videos"], []),
        "negative rect": (["levels", 0, "layers", 0, "texture_rect", 0], -2),
        "short rect": (["levels", 0, "layers", 0, "texture_rect"], [0, 0, 64]),
        "window": (["levels", 0, "layers", 0, "uv_window", 1], 2.5),
        "path": (["levels", 0, "layers", 0, "mesh"], "../layer_00.drc"),
        "hash": (["levels", 0, "texture", "videos", 0, "sha256"], "0" * 63),
        "count as text": (["levels", 0, "texture", "frames"], "5"),
        "codec": (["levels", 0, "texture", "videos", 0, "codec"], "mpeg2"),
        "fps": (["levels", 0, "texture", "frame_rate"], [0, 1]),
        "culling": (["compositing", "culling"], "back"),
        "rotation": (["coordinates", "to_capture", "rotation"], [[1, 0], [0, 1]]),
        "scale": (["coordinates", "to_capture", "scale"], 0),
        "no reflection": (["levels", 0, "reflection"], None),
        "rectangles": (["levels", 0, "reflection"], REFLECTION | {"gloss_rect": [0, 0, 4]}),
        "scales": (["levels", 0, "reflection"], REFLECTION | {"gloss_scale": 0}),
        "unknown key": (["levels", 0, "texture", "colour"], 1),
    }
    lacking: tuple[list[Any], ...] = (
        *(["subject"], ["audio"], ["photos"], ["compositing", "order"], ["coordinates", "to_capture"]),
        *(["levels", 0, "quality"], ["levels", 0, "texture", "videos", 0, "codec"]),
    )
    edits |= {f"no {place[-1]}": (place, LACKING) for place in lacking}
    made = {}
    for name, ((*way, last), new) in edits.items():
        made[name] = inner = copy.deepcopy(value)
        for key in way:
            inner = inner[key]
        if new is LACKING:
            del inner[last]
        else:
            inner[last] = new
    return made


def test_schema_and_models_refuse_the_same(path: Path, tmp_path: Path) -> None:
    validator = jsonschema.Draft202012Validator(json.loads(SCHEMA_PATH.read_text()))
    for name, value in broken(json.loads(path.read_text())).items():
        assert not validator.is_valid(value), name
        (tmp_path / "manifest.json").write_text(json.dumps(value))
        with pytest.raises(UserError):
            parse_manifest(tmp_path / "manifest.json")


def test_schema_and_models_accept_all_that_may_be_there(path: Path, tmp_path: Path) -> None:
    value = json.loads(path.read_text())
    stored = {"file": "a.x", "bytes": 1, "sha256": "0" * 64}
    poster = stored | {"width": 4, "height": 4}
    row = [1.0, 0.0, 0.0]
    photo = poster | {"camera": "a", "frame": 0, "K": [row] * 3, "w2c": [[*row, 0.0]] * 3}
    shown = poster | {"K": photo["K"], "w2c": photo["w2c"], "background": [0.0, 0.5, 1.0]}
    value |= {"audio": stored | {"mime": "audio/mp4"}, "poster": shown, "photos": [photo]}
    value["view"] = {"azimuth": [0.0, 1.0], "elevation": [0.0, 1.0], "distance": [1.0, 2.0], "measured": [row]}
    value |= {"extensionsUsed": ["A"], "extensions": {"A": {"b": [1, {}]}}, "extras": {"c": None}}
    value["track_file"] = stored
    level = value["levels"][0] | {"reflection": REFLECTION, "quality": {"psnr_to_model": 40.0, "target_psnr": 41.0}}
    level["layers"][0]["extras"] = "a note"
    value["levels"] = [level]
    jsonschema.Draft202012Validator(json.loads(SCHEMA_PATH.read_text())).validate(value)
    (tmp_path / "manifest.json").write_text(json.dumps(value))
    assert parse_manifest(tmp_path / "manifest.json").model_dump(mode="json") == value


def test_checksum_of_the_manifest(path: Path) -> None:
    raw = path.read_bytes()
    assert seal_is_whole(raw)
    assert not seal_is_whole(raw.replace(b"caps", b"cats"))
    assert not seal_is_whole(raw.replace(b"manifest_sha256", b"manifest_sha255"))


@pytest.mark.parametrize(
    ("text", "word"),
    [("{", "garbled"), ("[]", "not the manifest"), ("{}", "not the manifest"), ("null", "not the manifest")],
)
def test_not_a_manifest(tmp_path: Path, text: str, word: str) -> None:
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(UserError, match=word):
        parse_manifest(tmp_path / "manifest.json")


def test_a_newer_version_that_says_so_is_read_without_what_it_added(path: Path, tmp_path: Path) -> None:
    value = json.loads(path.read_text())
    newer = copy.deepcopy(value) | {"version": 5, "something": "new"}
    newer["levels"][0]["texture"]["more"] = [1]
    (tmp_path / "manifest.json").write_text(json.dumps(newer))
    assert parse_manifest(tmp_path / "manifest.json") == parse_manifest(path)
    (tmp_path / "manifest.json").write_text(json.dumps(newer | {"minVersion": 5}))
    with pytest.raises(UserError, match="another format version"):
        parse_manifest(tmp_path / "manifest.json")


@pytest.mark.parametrize(
    ("changes", "words", "found"),
    [
        ({"version": 7, "minVersion": 7}, "another format version", 7),
        ({"version": 3}, "another format version", 3),
        ({"extensionsUsed": ["A_b"], "extensionsRequired": ["A_b"]}, "extension", "A_b"),
    ],
)
def test_what_cannot_be_read_is_said_in_plain_words(
    path: Path, tmp_path: Path, changes: dict[str, Any], words: str, found: object
) -> None:
    (tmp_path / "manifest.json").write_text(json.dumps(json.loads(path.read_text()) | changes))
    with pytest.raises(UserError, match=words) as caught:
        parse_manifest(tmp_path / "manifest.json")
    assert caught.value.found == found
    assert "version" not in changes or caught.value.expected == 4


def test_generator_is_the_projects_version() -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert project["version"] == __version__
