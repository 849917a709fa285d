"""Draco round trips: what goes in comes out, in the same order."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.asset.draco import DracoError, decode_mesh, degenerate_faces, encode_mesh
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.params import MeshCodec
from tests.assets import cap_mesh


def shuffled_mesh() -> TexturedMesh:
    """A cap with vertices and faces in random order, one vertex doubled and one unused."""
    rng = np.random.default_rng(0)
    mesh = cap_mesh(0.4, 15)
    vertices = np.concatenate([mesh.vertices, mesh.vertices[:2]])
    st = np.concatenate([mesh.st, mesh.st[:2]])
    faces = np.where(mesh.faces == 0, len(mesh.vertices), mesh.faces)
    order = rng.permutation(len(vertices))
    faces = rng.permutation(np.argsort(order)[faces])
    return TexturedMesh(vertices[order], faces.astype(np.int32), st[order])


@pytest.mark.parametrize("level", [0, 7])
def test_without_quantisation_bits_and_order_are_kept(level: int) -> None:
    mesh = shuffled_mesh()
    decoded = decode_mesh(encode_mesh(mesh, MeshCodec(quantization_bits=0, compression_level=level))[0])
    for name in ("vertices", "faces", "st"):
        ours, theirs = getattr(mesh, name), getattr(decoded, name)
        assert ours.dtype == theirs.dtype and ours.tobytes() == theirs.tobytes(), name


@pytest.mark.parametrize(("bits", "st_bits", "level"), [(8, 8, 0), (14, 12, 0), (14, 12, 7), (20, 16, 10)])
def test_quantised_within_the_documented_bound(bits: int, st_bits: int, level: int) -> None:
    mesh = shuffled_mesh()
    codec = MeshCodec(quantization_bits=bits, texture_coordinate_bits=st_bits, compression_level=level)
    decoded = decode_mesh(encode_mesh(mesh, codec)[0])
    np.testing.assert_array_equal(decoded.faces, mesh.faces)
    reach = np.ptp(mesh.vertices, axis=0).max()
    assert np.abs(decoded.vertices - mesh.vertices).max() <= 0.5 * reach / (2**bits - 1) + 1e-7
    assert np.abs(decoded.st - mesh.st).max() <= 0.5 / (2**st_bits - 1) + 1e-7


def test_quantisation_makes_it_smaller() -> None:
    mesh = cap_mesh(0.4, 30)
    exact, _ = encode_mesh(mesh, MeshCodec())
    assert len(encode_mesh(mesh, MeshCodec(quantization_bits=11, compression_level=7))[0]) < len(exact) / 2


def test_faces_that_collapse_are_left_out() -> None:
    mesh = cap_mesh(0.4, 30)
    _, decoded = encode_mesh(mesh, MeshCodec(quantization_bits=4))
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
