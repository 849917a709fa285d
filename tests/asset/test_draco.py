"""Draco round trips: what goes in comes out, in the same order."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.asset.draco import DracoError, decode_mesh, degenerate_faces, encode_mesh
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.params import MeshCodec
from tests.assets import PLAIN, cap_mesh


def shuffled_mesh() -> TexturedMesh:
    """A cap with vertices and faces in random order, one vertex doubled and one unused."""
    rng = np.random.default_rng(0)
    mesh = cap_mesh(0.4, 15)
    vertices, st = (np.concatenate([values, values[:2]]) for values in (mesh.vertices, mesh.st))
    faces = np.where(mesh.faces == 0, len(mesh.vertices), mesh.faces)
    order = rng.permutation(len(vertices))
    faces = rng.permutation(np.argsort(order)[faces])
    return TexturedMesh(vertices[order], faces.astype(np.int32), st[order])


def soup(mesh: TexturedMesh) -> np.ndarray:
    """(F, 15): each triangle's corners (position and st), the first corner the least, triangles sorted."""
    corners = np.concatenate([mesh.vertices, mesh.st], 1)[mesh.faces]
    turned = [np.roll(triangle, -min(range(3), key=lambda i: tuple(triangle[i])), 0).ravel() for triangle in corners]
    return np.array(sorted(turned, key=tuple))


@pytest.mark.parametrize("level", [1, 7, 10])
def test_above_level_0_the_order_is_free_but_nothing_else(level: int) -> None:
    mesh = shuffled_mesh()
    decoded = decode_mesh(encode_mesh(mesh, MeshCodec(compression_level=level))[0])
    np.testing.assert_array_equal(soup(decoded), soup(mesh))


def test_without_quantisation_bits_and_order_are_kept() -> None:
    mesh = shuffled_mesh()
    decoded = decode_mesh(encode_mesh(mesh, MeshCodec(quantization_bits=0, compression_level=0))[0])
    for name in ("vertices", "faces", "st"):
        ours, theirs = getattr(mesh, name), getattr(decoded, name)
        assert ours.dtype == theirs.dtype and ours.tobytes() == theirs.tobytes(), name


@pytest.mark.parametrize(("bits", "st_bits", "level"), [(9, 9, 0), (14, 12, 0), (14, 12, 7), (20, 16, 10)])
def test_quantised_within_the_documented_bound(bits: int, st_bits: int, level: int) -> None:
    mesh = shuffled_mesh()
    codec = MeshCodec(quantization_bits=bits, texture_coordinate_bits=st_bits, compression_level=level)
    decoded = decode_mesh(encode_mesh(mesh, codec)[0])
    reach = np.ptp(mesh.vertices, axis=0).max()
    bounds = np.array([0.5 * reach / (2**bits - 1) + 1e-7] * 3 + [0.5 / (2**st_bits - 1) + 1e-7] * 2)
    ours, theirs = (np.concatenate([m.vertices, m.st], 1) for m in (mesh, decoded))
    used = np.unique(mesh.faces) if level else slice(None)
    distance = np.abs(ours[used][:, None] - theirs[None]) / bounds
    assert distance.max(-1).min(1).max() <= 1
    assert len(decoded.faces) == len(mesh.faces)


@pytest.mark.parametrize("bits", range(2, 13))
def test_quantised_texture_coordinates_stay_inside(bits: int) -> None:
    mesh = cap_mesh(0.4, 12)
    st = mesh.st * np.float32([1, 0.71]) + np.float32([0, 0.29])
    codec = MeshCodec(quantization_bits=12, texture_coordinate_bits=bits, compression_level=7)
    _, decoded = encode_mesh(TexturedMesh(mesh.vertices, mesh.faces, st), codec)
    assert decoded.st.min() >= -1e-6 and decoded.st.max() <= 1 + 1e-6


def test_quantisation_makes_it_smaller() -> None:
    mesh = cap_mesh(0.4, 30)
    exact, _ = encode_mesh(mesh, PLAIN.mesh)
    assert len(encode_mesh(mesh, MeshCodec(quantization_bits=11, compression_level=7))[0]) < len(exact) / 2


def test_faces_that_collapse_are_left_out() -> None:
    mesh = cap_mesh(0.4, 30)
    _, decoded = encode_mesh(mesh, MeshCodec(quantization_bits=4, compression_level=0))
    assert len(decoded.vertices) == len(mesh.vertices)
    assert 0 < len(decoded.faces) < len(mesh.faces)
    assert not degenerate_faces(decoded.vertices, decoded.faces).any()


def test_degenerate_faces_are_told_from_thin_ones() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1e-4, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 1, 1], [0, 2, 3], [0, 1, 3]], np.int32)
    np.testing.assert_array_equal(degenerate_faces(vertices, faces), [True, True, False, False])


@pytest.mark.parametrize("data", [b"", b"DRACO", b"no mesh at all" * 20])
def test_garbage_is_refused(data: bytes) -> None:
    with pytest.raises(DracoError):
        decode_mesh(data)
