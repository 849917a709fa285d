"""Layer meshes as Draco files (github.com/google/draco), through DracoPy.

With quantization_bits = 0 the floats come back bit for bit (the paper's setting, with compression level 0, which also
keeps the order of vertices and faces). With b > 0 bits a position is off by at most range / (2^b - 1) / 2 along each
axis (and float32 rounding), range being the largest side of the layer's bounding box; a texture coordinate likewise,
with its own number of bits and the larger extent of the layer's (s, t), at most 1, as range; next to 1 by at most twice
that, because what was rounded must not leave [0, 1].

Above compression level 0 Draco chooses the order of vertices and faces, and merges vertices that are equal: keeping the
order would cost more than half of the bytes of a quantised mesh.
"""

from __future__ import annotations

from typing import Protocol

import DracoPy
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.meshes import TexturedMesh


class MeshSettings(Protocol):
    """How a mesh is encoded: `compress.mesh` of params.yaml, or anything else with these."""

    @property
    def quantization_bits(self) -> int: ...
    @property
    def texture_coordinate_bits(self) -> int: ...
    @property
    def compression_level(self) -> int: ...


DEGENERATE = 1e-7
"""A face is degenerate if twice its area is not above this times its longest edge squared."""
MOST_CLAIMED = 1 << 24
"""Faces or vertices of a mesh: far more than any asset has."""


class DracoError(ValueError):
    """Bytes that are not a Draco mesh with texture coordinates; says why."""


def degenerate_faces(vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(F,) bool: faces without area (corners equal or in one line)."""
    corners = vertices[faces].astype(np.float64)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    longest = np.max([(edge**2).sum(-1) for edge in (a, b, b - a)], axis=0)
    return np.asarray(np.linalg.norm(np.cross(a, b), axis=-1) <= DEGENERATE * longest)


def encode_mesh(mesh: TexturedMesh, codec: MeshSettings) -> tuple[bytes, TexturedMesh]:
    """Encode a layer.

    Faces that have no area, or lose it by quantisation, are left out: they cover no pixel. In order (level 0) vertices
    all stay.

    Returns:
        the file's bytes, and the mesh that a reader gets from them.
    """
    ordered = _encode(mesh, codec, True)
    if codec.quantization_bits > 0 and decode_mesh(ordered).st.max() > 1:
        # The grid is that of the longer side of the box: along the other, rounding may lead out of [0, 1].
        inside = np.float32(1 - 0.5 / (2**codec.texture_coordinate_bits - 1))
        mesh = TexturedMesh(mesh.vertices, mesh.faces, np.minimum(mesh.st, inside))
        ordered = _encode(mesh, codec, True)
    flat = _flat(ordered)
    if flat.any() and not flat.all():
        mesh = TexturedMesh(mesh.vertices, mesh.faces[~flat], mesh.st)
        ordered = _encode(mesh, codec, True)
    if codec.compression_level > 0:
        data = _encode(mesh, codec, False)
        if not _flat(data).any():  # without unused vertices the box, and so the rounding, may differ
            return data, decode_mesh(data)
    return ordered, decode_mesh(ordered)


def _flat(data: bytes) -> NDArray[np.bool_]:
    mesh = decode_mesh(data)
    return degenerate_faces(mesh.vertices, mesh.faces)


def _encode(mesh: TexturedMesh, codec: MeshSettings, keep_order: bool) -> bytes:
    quantized = codec.quantization_bits > 0
    return bytes(
        DracoPy.encode(
            np.ascontiguousarray(mesh.vertices, np.float32),
            faces=np.ascontiguousarray(mesh.faces, np.uint32),
            quantization_bits=codec.quantization_bits,
            compression_level=codec.compression_level,
            # DracoPy reads texture coordinates as float64 and stores float32.
            tex_coord=np.ascontiguousarray(mesh.st, np.float64),
            tex_coord_quantization_bits=codec.texture_coordinate_bits if quantized else None,
            # Without it even level 0 merges vertices that are equal.
            preserve_order=keep_order,
        )
    )


def decode_mesh(data: bytes) -> TexturedMesh:
    """Decode a layer.

    Raises:
        DracoError: if the bytes are not a Draco triangle mesh with texture coordinates.
    """
    _check_claims(data)
    try:
        mesh = DracoPy.decode(data)
    except Exception as error:  # DracoPy's own exceptions have no common base.
        raise DracoError(str(error) or type(error).__name__) from None
    faces, st = getattr(mesh, "faces", None), getattr(mesh, "tex_coord", None)
    if faces is None or len(faces) == 0:
        raise DracoError("it has no faces")
    if st is None:
        raise DracoError("it has no texture coordinates")
    vertices = np.asarray(mesh.points, np.float32).reshape(-1, 3)
    st = np.asarray(st, np.float32)
    if st.shape != (len(vertices), 2):
        raise DracoError(f"texture coordinates of shape {st.shape} for {len(vertices)} vertices")
    return TexturedMesh(vertices, np.asarray(faces).astype(np.int32), st)


def attribute_ids(data: bytes) -> dict[str, int]:
    """The unique ids of a layer's attributes, by the names that glTF has for them."""
    names = {0: "POSITION", 3: "TEXCOORD_0"}  # draco::GeometryAttribute::Type
    attributes = DracoPy.decode(data).attributes
    return {names[one["attribute_type"]]: one["unique_id"] for one in attributes if one["attribute_type"] in names}


def _check_claims(data: bytes) -> None:
    """Refuse a mesh that claims more than any has, before the decoder makes room for it.

    Draco's header (bitstream 2.2): "DRACO", version (2), kind (1: mesh), method (0 sequential, 1 edgebreaker), flags
    (2); then, if there are no metadata, the numbers of faces and points, or a byte and those of vertices and faces.

    Raises:
        DracoError: if it does, or is no mesh.
    """
    if len(data) < 12 or data[:5] != b"DRACO":
        raise DracoError("it does not begin with Draco's header")
    major, minor, kind, method = data[5:9]
    if kind != 1:
        raise DracoError("it holds no mesh")
    if (major, minor) != (2, 2) or data[10] & 0x80:
        return  # other versions and metadata: laid out otherwise, and no writer of assets makes them
    place = 11 if method == 0 else 12
    for _ in range(2):
        count, shift = 0, 0
        while True:
            if place >= len(data) or shift > 28:
                raise DracoError("its header is cut off")
            byte = data[place]
            count |= (byte & 0x7F) << shift
            place, shift = place + 1, shift + 7
            if byte < 0x80:
                break
        if count > MOST_CLAIMED:
            raise DracoError(f"it claims {count} faces or vertices")
