"""The GLB says what the asset says, and Khronos' validator has nothing against it."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from facefolds_core.asset import Asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.opaque import opaque_where_covered
from facefolds_core.geometry.sphere_uv import uv_to_directions
from facefolds_core.params import CompressParams, MeshCodec
from tests.assets import CENTRE, make_asset
from tests.gltf_files import complaints, opened, part, validator_report

Opened = tuple[dict[str, Any], bytes]
"""A document and its binary chunk."""


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    params = CompressParams(mesh=MeshCodec(quantization_bits=14, compression_level=7))
    return make_asset(tmp_path_factory.mktemp("glb") / "asset", layers=3, frames=3, params=params)


@pytest.fixture(scope="module")
def written(asset: Asset) -> Opened:
    """Its first frame."""
    write_glb(asset.folder.with_suffix(".glb"), asset.full, "caps")
    return opened(asset.folder.with_suffix(".glb"))


def test_each_layer_shows_its_texture(asset: Asset, tmp_path: Path) -> None:
    """At the places where vertices are, in the one picture."""
    write_glb(tmp_path / "a.glb", asset.full, "caps", frame=2)
    document, binary = opened(tmp_path / "a.glb")
    pixels = np.asarray(Image.open(io.BytesIO(part(document, binary, document["images"][0]["bufferView"]))))
    height, width = pixels.shape[:2]
    positions, places = values(document, binary, "POSITION", 3), values(document, binary, "TEXCOORD_0", 2)
    np.testing.assert_array_equal(positions, np.concatenate([layer.vertices for layer in asset.layers]))
    start = 0
    for layer, texture in zip(asset.layers, asset.frame(2), strict=True):
        st = places[start : start + len(layer.vertices)] * (width, height)
        start += len(layer.vertices)
        x, y = np.rint((st - layer.st * texture.shape[1::-1])[0]).astype(int)
        found = pixels[y : y + texture.shape[0], x : x + texture.shape[1]]
        np.testing.assert_array_equal(found[..., :3], texture[..., :3])
        assert ((found[..., 3] == texture[..., 3]) | (found[..., 3] == 255)).all()
        np.testing.assert_array_equal(pixels[y - 1, x : x + texture.shape[1]], found[0])  # the gutter repeats it


def test_places_on_the_chart_are_those_of_the_directions(written: Opened) -> None:
    document, binary = written
    chart = values(document, binary, "TEXCOORD_1", 2).astype(np.float64)
    uv = np.stack([2 - 4 * chart[:, 1], 4 * chart[:, 0] - 2], -1)
    towards = values(document, binary, "POSITION", 3) - np.array(CENTRE)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    assert np.abs(uv_to_directions(uv) - towards).max() < 2e-3


def values(document: dict[str, Any], binary: bytes, name: str, width: int) -> np.ndarray[Any, Any]:
    """An attribute of all vertices (V, width)."""
    return numbers(document, binary, document["meshes"][0]["primitives"][0]["attributes"][name], "<f4", width)


def faces_of(document: dict[str, Any], binary: bytes, primitive: int) -> np.ndarray[Any, Any]:
    return numbers(document, binary, document["meshes"][0]["primitives"][primitive]["indices"], "<u4", 3)


def numbers(document: dict[str, Any], binary: bytes, accessor: int, kind: str, width: int) -> np.ndarray[Any, Any]:
    view = document["accessors"][accessor]["bufferView"]
    return np.frombuffer(part(document, binary, view), kind).reshape(-1, width)


def test_the_subject_looks_to_z_with_y_up(written: Opened) -> None:
    document, _ = written
    turn = Rotation.from_quat(document["nodes"][document["scenes"][0]["nodes"][0]]["rotation"])
    np.testing.assert_allclose(turn.apply(np.eye(3)), [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-12)  # +x -> +z, ...


def test_the_shell_comes_from_within_and_from_the_back_without_backs(asset: Asset, written: Opened) -> None:
    document, binary = written
    assert [material["alphaMode"] for material in document["materials"]] == ["MASK", "BLEND"]
    assert not any(material["doubleSided"] for material in document["materials"])
    faces = faces_of(document, binary, 1)
    starts = np.cumsum([0] + [len(layer.vertices) for layer in asset.layers])
    for index in reversed(range(3)):
        layer, texture = asset.layers[index], asset.frame(0)[index]
        own = faces[(faces[:, 0] >= starts[index]) & (faces[:, 0] < starts[index + 1])] - starts[index]
        faces = faces[len(own) :]
        assert (np.diff(layer.vertices[own, 0].mean(1)) >= 0).all()
        left_out = {tuple(face) for face in layer.faces} - {tuple(face) for face in own}
        assert len(left_out) + len(own) == len(layer.faces)
        for face in left_out:
            columns, rows = np.rint(layer.st[list(face)] * texture.shape[1::-1]).astype(int).T
            assert not texture[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1, 3].any()
    assert len(faces) == 0


def test_the_core_has_the_triangles_with_opaque_texels(asset: Asset, written: Opened) -> None:
    document, binary = written
    core = {tuple(face) for face in faces_of(document, binary, 0)}
    assert 0 < len(core) < sum(len(layer.faces) for layer in asset.layers)
    textures = opaque_where_covered(asset.frame(0), asset.windows)
    starts = np.cumsum([0] + [len(layer.vertices) for layer in asset.layers])
    for layer, texture, start in zip(asset.layers, textures, starts[:-1], strict=True):
        for face in layer.faces:
            column, row = (layer.st[face].mean(0) * texture.shape[1::-1]).astype(int)
            assert tuple(face + start) in core or texture[row, column, 3] < 255


def test_what_is_covered_becomes_opaque() -> None:
    """Alpha of two layers in one window: 0.8 over 0.8 lets 4 % through, 0.5 over 0.5 a quarter, 1 over 0.05 nothing."""
    outer, inner = np.zeros((2, 1, 3, 4), np.uint8)
    outer[0, :, 3], inner[0, :, 3] = (204, 128, 255), (204, 128, 13)
    changed = opaque_where_covered([outer, inner], [(-1, 1, -1, 1)] * 2)
    assert [layer[0, :, 3].tolist() for layer in changed] == [[204, 128, 255], [255, 128, 13]]


def test_windows_are_minded_where_layers_are_compared() -> None:
    """The outer layer covers the inner one's left half alone."""
    outer, inner = np.full((1, 1, 4), 255, np.uint8), np.full((1, 2, 4), 100, np.uint8)
    _, changed = opaque_where_covered([outer, inner], [(-1, 1, -1, 0), (-1, 1, -1, 1)])
    assert changed[0, :, 3].tolist() == [255, 100]


def test_khronos_validator(asset: Asset, written: Opened) -> None:
    report = validator_report(asset.folder.with_suffix(".glb"))
    assert complaints(report) == []
    assert report["info"]["drawCallCount"] == 2
