"""The GLB says what the asset says, and Khronos' validator has nothing against it."""

from __future__ import annotations

import io
import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from facefolds_core.asset import Asset, read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.errors import UserError
from facefolds_core.params import CompressParams, MeshCodec
from tests.assets import make_asset

ROOT = Path(__file__).parents[2]
VALIDATE = """
const fs = require("fs"), validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(r => console.log(JSON.stringify(r)));
"""


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    folder = tmp_path_factory.mktemp("glb") / "asset"
    mesh = MeshCodec(quantization_bits=14, compression_level=7)
    make_asset(folder, layers=3, frames=3, params=CompressParams(mesh=mesh))
    return read_asset(folder)


def opened(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def part(document: dict[str, Any], binary: bytes, view: int) -> bytes:
    entry = document["bufferViews"][view]
    return binary[entry["byteOffset"] : entry["byteOffset"] + entry["byteLength"]]


def test_layers_come_back_innermost_first(asset: Asset, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", asset.full, "caps", frame=2)
    document, binary = opened(tmp_path / "a.glb")
    textures = asset.frame(2)
    for place, index in enumerate((2, 1, 0)):
        (primitive,) = document["meshes"][document["nodes"][place]["mesh"]]["primitives"]
        layer = asset.layers[index]
        accessor = document["accessors"][primitive["attributes"]["POSITION"]]
        assert part(document, binary, accessor["bufferView"]) == layer.vertices.tobytes()
        image = document["images"][document["textures"][place]["source"]]
        pixels = np.asarray(Image.open(io.BytesIO(part(document, binary, image["bufferView"]))))
        np.testing.assert_array_equal(pixels, textures[index])


def test_the_subject_looks_to_z_with_y_up(asset: Asset, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", asset.full, "caps")
    document, _ = opened(tmp_path / "a.glb")
    x, y, z, w = document["nodes"][document["scenes"][0]["nodes"][0]]["rotation"]
    axis = np.array([x, y, z])
    turned = [v + 2 * w * np.cross(axis, v) + 2 * np.cross(axis, np.cross(axis, v)) for v in np.eye(3)]
    np.testing.assert_allclose(turned, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-12)  # +x -> +z, +y -> +x, +z -> +y


def test_a_frame_that_is_not_there(asset: Asset, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such frame"):
        write_glb(tmp_path / "a.glb", asset.full, "caps", frame=3)


def test_backs_are_left_out_and_triangles_come_from_the_back_to_the_front(asset: Asset, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", asset.full, "caps")
    document, binary = opened(tmp_path / "a.glb")
    assert not any(material.get("doubleSided") for material in document["materials"])
    for place, layer in enumerate(reversed(asset.layers)):
        (primitive,) = document["meshes"][place]["primitives"]
        view = document["accessors"][primitive["indices"]]["bufferView"]
        faces = np.frombuffer(part(document, binary, view), "<u4").reshape(-1, 3)
        assert (np.diff(layer.vertices[faces, 0].mean(1)) >= 0).all()
        assert sorted(map(tuple, faces)) == sorted(map(tuple, layer.faces))


def test_khronos_validator(asset: Asset, tmp_path: Path) -> None:
    if shutil.which("node") is None or not (ROOT / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("no gltf-validator: install Node.js and run `npm install --no-save gltf-validator`")
    write_glb(tmp_path / "a.glb", asset.full, "caps")
    command = ["node", "-e", VALIDATE, str(tmp_path / "a.glb")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    report = json.loads(done.stdout)
    worse = [message for message in report["issues"]["messages"] if message["severity"] <= 1]
    assert worse == [], worse
    assert report["info"]["totalTriangleCount"] == sum(len(layer.faces) for layer in asset.layers)
