"""EXT_layered_volumetric_video: its schema, its document's example, and what the exporter writes."""

from __future__ import annotations

import hashlib
import io
import json
import re
from pathlib import Path
from typing import Any

import av
import DracoPy
import jsonschema
import numpy as np
import pytest
from scipy.spatial import cKDTree

from facefolds_core.asset import read_asset
from facefolds_core.asset.audio import AAC_MIME, encode_sound
from facefolds_core.asset.gltf.checking import check_glb
from facefolds_core.asset.gltf.extension import NAME, SCHEMA, LayeredVideo, schema, write_schema
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.cli.export import export
from facefolds_core.params import CompressParams, MeshCodec
from tests.assets import OVER_TORSO, TORSO, TRACK
from tests.gltf_files import complaints, opened, part, validator_report
from tests.viewer.fixtures import change_manifest, file_entry, moving_asset

HOME = Path(__file__).parents[2] / "docs" / "reference" / NAME
FRAMES = 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An asset with all that the extension says: a track over a torso, and a reflection."""
    params = CompressParams(mesh=MeshCodec(quantization_bits=14, compression_level=7))
    return moving_asset(tmp_path_factory.mktemp("gltf") / "asset", OVER_TORSO, params=params).folder


@pytest.fixture(scope="module")
def written(folder: Path) -> tuple[dict[str, Any], bytes]:
    write_layered(folder.with_suffix(".glb"), read_asset(folder).full, "caps", still=1)
    return opened(folder.with_suffix(".glb"))


def said(document: dict[str, Any]) -> Any:
    return document["nodes"][0]["extensions"][NAME]


TEXT = (HOME / "README.md").read_text(encoding="utf-8")
[EXAMPLE] = [json.loads(block) for block in re.findall(r"```json\n(.*?)```", TEXT, re.DOTALL)]


def test_the_schema_is_the_models(tmp_path: Path) -> None:
    write_schema(tmp_path)
    assert (tmp_path / SCHEMA).read_text() == (HOME / "schema" / SCHEMA).read_text()
    jsonschema.Draft202012Validator.check_schema(schema())


def test_the_documents_example_is_valid() -> None:
    jsonschema.validate(said(EXAMPLE), schema())
    LayeredVideo.model_validate_json(json.dumps(said(EXAMPLE)))


def test_the_documents_table_names_every_property() -> None:
    table = TEXT[TEXT.index("### Properties") : TEXT.index("### JSON Schema")]
    named = set(re.findall(r"`(\w+)`", table)) - {"KHR_texture_video"}
    keys = set(schema()["properties"]) | {name for one in schema()["$defs"].values() for name in one["properties"]}
    assert named == keys - {"extensions", "extras"}


@pytest.mark.parametrize("key", ["mesh", "textures", "rectangles", "frameRate"])
def test_schema_and_models_refuse_the_same(key: str) -> None:
    for value in (None, -1, [], "0", 1.5, [[1, 2, 3]], [0, -1]):
        one = {**said(EXAMPLE), key: value}
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(one, schema())
        with pytest.raises(ValueError):
            LayeredVideo.model_validate_json(json.dumps(one))


def test_khronos_validator(folder: Path, written: tuple[dict[str, Any], bytes]) -> None:
    report = validator_report(folder.with_suffix(".glb"))
    assert complaints(report) == []
    assert report["info"]["animationCount"] == 1


def test_what_is_said_is_the_assets(folder: Path, written: tuple[dict[str, Any], bytes]) -> None:
    document, binary = written
    one, level = said(document), read_asset(folder).full
    jsonschema.validate(one, schema())
    texture = level.entry.texture
    assert one["colorRectangle"] == list(texture.colour_rect) and one["alphaRectangle"] == list(texture.alpha_rect)
    assert one["rectangles"] == [list(layer.texture_rect) for layer in level.entry.layers]
    assert (one["frames"], one["frameRate"], one["stillFrame"]) == (FRAMES, [30, 1], 1)
    source = document["textures"][one["textures"][0]]["extensions"]["KHR_texture_video"]["source"]
    video = document["extensions"]["KHR_texture_video"]["videos"][source]
    assert part(document, binary, video["bufferView"]) == (folder / texture.videos[0].file).read_bytes()
    assert "extensionsRequired" not in document


def test_layers_are_the_assets_meshes(folder: Path, written: tuple[dict[str, Any], bytes]) -> None:
    document, binary = written
    for primitive, layer in zip(document["meshes"][1]["primitives"], read_asset(folder).layers, strict=True):
        compressed = primitive["extensions"]["KHR_draco_mesh_compression"]
        mesh = DracoPy.decode(part(document, binary, compressed["bufferView"]))
        ids = compressed["attributes"]
        np.testing.assert_array_equal(mesh.get_attribute_by_unique_id(ids["POSITION"])["data"], layer.vertices)
        np.testing.assert_array_equal(mesh.get_attribute_by_unique_id(ids["TEXCOORD_0"])["data"], layer.st)
        accessors = [document["accessors"][i] for i in (*primitive["attributes"].values(), primitive["indices"])]
        assert [one["count"] for one in accessors] == [len(layer.vertices)] * 2 + [layer.faces.size]


def test_the_animation_is_the_track(written: tuple[dict[str, Any], bytes]) -> None:
    document, binary = written
    one = document["animations"][0]
    wanted = {"rotation": TRACK.quaternions[:, [1, 2, 3, 0]], "translation": TRACK.translations}
    for channel in one["channels"]:
        sampler, path = one["samplers"][channel["sampler"]], channel["target"]["path"]
        views = [document["accessors"][sampler[end]]["bufferView"] for end in ("input", "output")]
        times, values = (np.frombuffer(part(document, binary, view), "<f4") for view in views)
        np.testing.assert_allclose(times, np.arange(FRAMES) / 30, rtol=1e-6)
        np.testing.assert_allclose(values.reshape(FRAMES, -1), wanted.pop(path), atol=1e-6)
        np.testing.assert_allclose(document["nodes"][0][path], values.reshape(FRAMES, -1)[1], atol=1e-6)
    assert not wanted


def test_the_still_stands_over_its_torso(folder: Path, tmp_path: Path) -> None:
    level = read_asset(folder).full
    write_layered(tmp_path / "face.glb", level, "caps", still=2)
    document, binary = opened(tmp_path / "face.glb")
    track, one = level.track, said(document)["torso"]
    assert one["rotation"] == pytest.approx([*TORSO.quaternion[1:], TORSO.quaternion[0]])
    primitive = document["meshes"][0]["primitives"][0]
    view = document["accessors"][primitive["attributes"]["POSITION"]]["bufferView"]
    vertices = np.frombuffer(part(document, binary, view), "<f4").reshape(-1, 3)
    made = np.concatenate([layer.vertices for layer in level.layers])
    off = [cKDTree(places).query(vertices)[0].max() for places in (track.posed(made, 2), made)]
    assert off[0] < 1e-6 < 0.01 < off[1]


def test_the_command_writes_it(folder: Path, tmp_path: Path) -> None:
    assert export("gltf", folder, tmp_path / "face.glb", None).startswith("3 layers, 3 frames, 0.0")
    assert said(opened(tmp_path / "face.glb")[0])["stillFrame"] == 0


def test_the_still_is_of_the_coarsest_level(rich: Path, tmp_path: Path) -> None:
    export("gltf", rich, tmp_path / "face.glb", None)
    document, _ = opened(tmp_path / "face.glb")
    coarse, full = read_asset(rich).levels
    still, layers = document["meshes"]
    corners = document["accessors"][still["primitives"][0]["attributes"]["POSITION"]]["count"]
    assert corners <= sum(len(mesh.vertices) for mesh in coarse.layers)
    assert len(layers["primitives"]) == full.num_layers == coarse.num_layers + 1
    assert complaints(validator_report(tmp_path / "face.glb")) == []


def test_checksums_cover_what_it_refers_to(written: tuple[dict[str, Any], bytes]) -> None:
    document, binary = written
    sums = {one["bufferView"]: one["sha256"] for one in said(document)["checksums"]}
    views = range(len(document["bufferViews"]))
    assert sums == {i: hashlib.sha256(part(document, binary, i)).hexdigest() for i in views}


def packets(data: bytes, kind: str) -> list[tuple[bytes, float]]:
    """Of a stream of an MP4: (bytes, seconds)."""
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.get({kind: 0})[0]
        return [(bytes(one), float(one.pts * one.time_base)) for one in container.demux(stream) if one.pts is not None]


@pytest.mark.parametrize("encoded", [False, True])
def test_the_sound_lies_in_the_video(rich_copy: Path, tmp_path: Path, encoded: bool) -> None:
    """The pictures stay as they are, and so does sound that is AAC already."""
    sound = rich_copy / "sound.mp4"
    if encoded:
        encode_sound(sound, rich_copy / "audio.wav", 0.2)
        change_manifest(rich_copy, lambda value: value.update(audio=file_entry(sound) | {"mime": AAC_MIME}))
    export("gltf", rich_copy, tmp_path / "face.glb", None)
    document, binary = opened(tmp_path / "face.glb")
    [video] = document["extensions"]["KHR_texture_video"]["videos"]
    data, level = part(document, binary, video["bufferView"]), read_asset(rich_copy).full
    assert video["mimeType"].startswith('video/mp4; codecs="avc1') and video["mimeType"].endswith(', mp4a.40.2"')
    assert packets(data, "video") == packets((rich_copy / level.entry.texture.videos[0].file).read_bytes(), "video")
    heard = packets(data, "audio")
    assert sum(len(one) for one, _ in heard) > 500
    assert not encoded or heard == packets(sound.read_bytes(), "audio")
    assert check_glb(tmp_path / "face.glb") == []
