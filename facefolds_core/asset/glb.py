"""One frame of an asset as a binary glTF 2.0 file (GLB), for programs that know nothing of the asset format.

A node, mesh, material and PNG for each layer: KHR_materials_unlit, alphaMode BLEND, edges clamped. Programs blend every
crossing of a sheet, where the format counts the nearest one: so backs are left out (not double-sided), and plain meshes
list their triangles from the back to the front, as seen from before the face. Draco keeps the asset's own order. The
root node turns the asset's axes into glTF's (y up, the subject looks to +z): (x, y, z) -> (y, z, x). Nodes are listed
from the innermost layer to the outermost: viewers draw blended objects at one distance in that order.

glTF's viewers decode colours to linear light before they blend, the asset's players do not: half-transparent parts look
slightly different (docs/reference/asset-format.md).
"""

from __future__ import annotations

import io
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.reader import AssetLevel
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.track import Track

TO_Y_UP = [-0.5, -0.5, -0.5, 0.5]
"""Quaternion (x, y, z, w) of the rotation (x, y, z) -> (y, z, x)."""
UNLIT = "KHR_materials_unlit"
FLOAT, UNSIGNED_INT = 5126, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
LINEAR, CLAMP_TO_EDGE = 9729, 33071


@dataclass
class Builder:
    """glTF's arrays as they grow, and the binary chunk."""

    binary: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes, aligned to 4; returns the index of their buffer view."""
        self.binary += bytes(-len(self.binary) % 4)
        extra = {} if target is None else {"target": target}
        self.views.append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **extra})
        self.binary += data
        return len(self.views) - 1

    def accessor(self, kind: str, component: int, values: NDArray[Any], view: int, bounds: bool = False) -> int:
        """Describe an array (count, ...); returns its index."""
        entry: dict[str, Any] = {"componentType": component, "count": len(values), "type": kind, "bufferView": view}
        if bounds:
            entry |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def primitive(self, mesh: TexturedMesh) -> dict[str, Any]:
        """A layer's triangles."""
        indices = back_to_front(mesh).astype("<u4").ravel()
        arrays = (("POSITION", "VEC3", mesh.vertices), ("TEXCOORD_0", "VEC2", mesh.st))
        attributes = {}
        for name, kind, values in arrays:
            view = self.view(values.astype("<f4").tobytes(), ARRAY_BUFFER)
            attributes[name] = self.accessor(kind, FLOAT, values, view, bounds=name == "POSITION")
        view = self.view(indices.tobytes(), ELEMENT_ARRAY_BUFFER)
        return {
            "attributes": attributes,
            "indices": self.accessor("SCALAR", UNSIGNED_INT, indices, view),
        }


def write_glb(path: Path, level: AssetLevel, name: str, frame: int = 0) -> None:
    """Write a level's `frame` as a GLB.

    Args:
        name: of the root node.

    Raises:
        UserError: if there is no such frame.
    """
    if not 0 <= frame < level.num_frames:
        raise UserError(
            "no such frame for the GLB",
            place="compress.glb.frame",
            expected=f"0 to {level.num_frames - 1}",
            found=frame,
            remedy="correct it in params.yaml",
        )
    builder = Builder()
    meshes, materials, images, nodes = [], [], [], []
    textures = level.frame(frame)
    for place, index in enumerate(reversed(range(level.num_layers))):
        label = f"layer_{index:02d}"
        primitive = builder.primitive(level.layers[index]) | {"material": place}
        meshes.append({"name": label, "primitives": [primitive]})
        images.append({"name": label, "mimeType": "image/png", "bufferView": builder.view(_png(textures[index]))})
        materials.append(_material(label, place))
        nodes.append({"name": label, "mesh": place})
    count, children = len(nodes), list(range(len(nodes)))
    if level.track is not None:
        nodes.append({"name": "head", "children": children, **_pose(level.track, frame)})
        children = [count]
    document = {
        "asset": {"version": "2.0", "generator": "facefolds"},
        "extensionsUsed": [UNLIT],
        "scene": 0,
        "scenes": [{"nodes": [len(nodes)]}],
        "nodes": [*nodes, {"name": name, "rotation": TO_Y_UP, "children": children}],
        "meshes": meshes,
        "materials": materials,
        "textures": [{"source": place, "sampler": 0} for place in range(count)],
        "images": images,
        "samplers": [{"magFilter": LINEAR, "minFilter": LINEAR, "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE}],
        "accessors": builder.accessors,
        "bufferViews": builder.views,
        "buffers": [{"byteLength": len(builder.binary)}],
    }
    with atomic_file(path) as temporary:
        temporary.write_bytes(_container(document, bytes(builder.binary)))


def _pose(track: Track, frame: int) -> dict[str, list[float]]:
    """Of a node: where the head stands in a frame."""
    w, x, y, z = track.quaternions[frame].tolist()
    return {"rotation": [x, y, z, w], "translation": track.translations[frame].tolist()}


def _material(name: str, texture: int) -> dict[str, Any]:
    return {
        "name": name,
        "alphaMode": "BLEND",
        "doubleSided": False,
        "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}, "metallicFactor": 0.0, "roughnessFactor": 1.0},
        "extensions": {UNLIT: {}},
    }


def back_to_front(mesh: TexturedMesh) -> NDArray[np.int32]:
    """The faces, farthest from a viewer before the face (+x) first: nearer folds of a sheet are drawn over farther."""
    depth = mesh.vertices[mesh.faces, 0].mean(1)
    return mesh.faces[np.argsort(depth, kind="stable")]


def _png(texture: NDArray[np.uint8]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(texture).save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def _container(document: dict[str, Any], binary: bytes) -> bytes:
    """The GLB container: a header and two chunks, each padded to 4 bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
