"""The manifest and its JSON schema say the same."""

from __future__ import annotations

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
from tests.hostile.fuzz_assets import LACKING, put


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("manifest") / "asset"
    make_asset(folder, frames=1)
    return folder / "manifest.json"


SCHEMA = json.loads(SCHEMA_PATH.read_text())
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def test_schema_file_is_in_step() -> None:
    # If this fails: call facefolds_core.asset.manifest.write_schema()
    assert manifest_schema() == SCHEMA


def test_schema_is_valid_and_accepts_a_manifest(path: Path) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    VALIDATOR.validate(json.loads(path.read_text()))


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


LEVEL = ("levels", 0)
LAYER, TEXTURE, VIDEO = (*LEVEL, "layers", 0), (*LEVEL, "texture"), (*LEVEL, "texture", "videos", 0)
PLACE = ("coordinates", "to_capture")
BROKEN: list[tuple[tuple[str | int, ...], Any]] = [
    (("format",), "gltf"),
    (("version",), "3"),
    (("version",), 0),
    (("minVersion",), 4),
    (("extensionsUsed",), [""]),
    (("extras",), None),
    ((*LEVEL, "extensions"), {"A": 1}),
    (("levels",), []),
    ((*LEVEL, "name"), "Full"),
    ((*LEVEL, "layers"), []),
    ((*TEXTURE, "videos"), []),
    ((*LAYER, "texture_rect", 0), -2),
    ((*LAYER, "texture_rect"), [0, 0, 64]),
    ((*LAYER, "uv_window", 1), 2.5),
    ((*LAYER, "mesh"), "../layer_00.drc"),
    ((*VIDEO, "sha256"), "0" * 63),
    ((*TEXTURE, "frames"), "5"),
    ((*VIDEO, "codec"), "mpeg2"),
    ((*TEXTURE, "frame_rate"), [0, 1]),
    (("compositing", "culling"), "back"),
    ((*PLACE, "rotation"), [[1, 0], [0, 1]]),
    ((*PLACE, "scale"), 0),
    ((*LEVEL, "reflection"), None),
    ((*LEVEL, "reflection"), REFLECTION | {"gloss_rect": [0, 0, 4]}),
    ((*LEVEL, "reflection"), REFLECTION | {"gloss_scale": 0}),
    ((*TEXTURE, "colour"), 1),
    *((place, LACKING) for place in (("subject",), ("audio",), ("photos",), ("compositing", "order"), PLACE)),
    *((place, LACKING) for place in ((*LEVEL, "quality"), (*VIDEO, "codec"))),
]
"""Each breaks one rule."""


@pytest.mark.parametrize(("place", "new"), BROKEN)
def test_schema_and_models_refuse_the_same(
    path: Path, tmp_path: Path, place: tuple[str | int, ...], new: object
) -> None:
    value = json.loads(path.read_text())
    put(*place, to=new)(value)
    assert not VALIDATOR.is_valid(value)
    with pytest.raises(UserError):
        parse_manifest(written(tmp_path, json.dumps(value)))


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
    VALIDATOR.validate(value)
    assert parse_manifest(written(tmp_path, json.dumps(value))).model_dump(mode="json") == value


def test_checksum_of_the_manifest(path: Path) -> None:
    raw = path.read_bytes()
    assert seal_is_whole(raw)
    assert not seal_is_whole(raw.replace(b"caps", b"cats"))
    assert not seal_is_whole(raw.replace(b"manifest_sha256", b"manifest_sha255"))


def written(folder: Path, text: str) -> Path:
    (folder / "manifest.json").write_text(text)
    return folder / "manifest.json"


@pytest.mark.parametrize(
    ("text", "word"),
    [("{", "garbled"), ("[]", "not the manifest"), ("{}", "not the manifest"), ("null", "not the manifest")],
)
def test_not_a_manifest(tmp_path: Path, text: str, word: str) -> None:
    with pytest.raises(UserError, match=word):
        parse_manifest(written(tmp_path, text))


def test_a_newer_version_that_says_so_is_read_without_what_it_added(path: Path, tmp_path: Path) -> None:
    newer = json.loads(path.read_text()) | {"version": 5, "something": "new"}
    newer["levels"][0]["texture"]["more"] = [1]
    assert parse_manifest(written(tmp_path, json.dumps(newer))) == parse_manifest(path)


@pytest.mark.parametrize(
    ("changes", "words", "found"),
    [
        ({"version": 7, "minVersion": 7}, "another format version", 7),
        ({"version": 5, "minVersion": 5}, "another format version", 5),
        ({"version": 3}, "another format version", 3),
        ({"extensionsUsed": ["A_b"], "extensionsRequired": ["A_b"]}, "extension", "A_b"),
    ],
)
def test_what_cannot_be_read_is_said_in_plain_words(
    path: Path, tmp_path: Path, changes: dict[str, Any], words: str, found: object
) -> None:
    with pytest.raises(UserError, match=words) as caught:
        parse_manifest(written(tmp_path, json.dumps(json.loads(path.read_text()) | changes)))
    assert caught.value.found == found
    assert "version" not in changes or caught.value.expected == 4


def test_generator_is_the_projects_version() -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert project["version"] == __version__
