"""One frame of an asset as a binary glTF 2.0 file (GLB), for programs that know nothing of the asset format.

One mesh, one picture. Programs blend every crossing of a sheet, where the format counts the nearest one, and sort
whole meshes, not triangles. So the mesh is listed twice. First its opaque core (`alphaMode` MASK, which writes depth):
it hides all that lies behind. Then the soft shell (BLEND), from the innermost layer to the outermost, each from the
back to the front as seen from before the face, without backs. KHR_materials_unlit; each layer has a gutter.
The root node turns the asset's axes into glTF's (y up, the subject looks to +z): (x, y, z) -> (y, z, x).

Measured in three.js and model-viewer: docs/guide/engines.md.
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.opaque import faces_over, opaque_where_covered
from facefolds_core.asset.packing import GUTTER
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.files.writing import atomic_file
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import st_to_uv
from facefolds_core.geometry.track import Track

TO_Y_UP = [-0.5, -0.5, -0.5, 0.5]
"""Quaternion (x, y, z, w) of the rotation (x, y, z) -> (y, z, x)."""
UNLIT = "KHR_materials_unlit"
FLOAT, UNSIGNED_INT = 5126, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
SAMPLER = {"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071}
"""Linear, clamped to the edge."""
CUTOFF = 0.9
"""Of the core's alpha; it is 1 there, and filtered at its rim."""


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

    def describe(self, kind: str, component: int, count: int, **extra: Any) -> int:
        """An accessor; returns its index."""
        self.accessors.append({"componentType": component, "count": count, "type": kind, **extra})
        return len(self.accessors) - 1

    def accessor(
        self, kind: str, component: int, values: NDArray[Any], view: int, bounds: bool = False, **extra: Any
    ) -> int:
        """Describe a stored array (count, ...); returns the accessor's index."""
        if bounds:
            extra |= {"min": np.atleast_1d(values.min(0)).tolist(), "max": np.atleast_1d(values.max(0)).tolist()}
        return self.describe(kind, component, len(values), bufferView=view, **extra)

    def array(self, kind: str, values: NDArray[Any], bounds: bool = False, target: int | None = ARRAY_BUFFER) -> int:
        """Store floats (count, ...), by default a value a vertex; returns the index of their accessor."""
        stored = values.astype("<f4")
        return self.accessor(kind, FLOAT, stored, self.view(stored.tobytes(), target), bounds)

    def indices(self, faces: NDArray[np.intp]) -> int:
        """Store triangles (F, 3); returns the index of their accessor."""
        values = faces.astype("<u4").ravel()
        return self.accessor("SCALAR", UNSIGNED_INT, values, self.view(values.tobytes(), ELEMENT_ARRAY_BUFFER))


def write_glb(path: Path, level: AssetLevel, name: str, frame: int = 0) -> None:
    """Write a level's `frame` as a GLB.

    Args:
        name: of the root node.
    """
    level = posed(level, frame)
    textures = opaque_where_covered(level.frame(frame), level.windows)
    builder = Builder()
    primitives = _primitives(builder, level, triangles_of(level, textures))
    picture = builder.view(png(picture_of(level, textures)))
    nodes: list[dict[str, Any]] = [{"name": "layers", "mesh": 0, "extras": {"layers": level.num_layers}}]
    if level.track is not None:
        nodes.append({"name": "head", "children": [0], **pose_of(level.track, frame)})
    write_document(
        path,
        name,
        builder,
        nodes,
        extensionsUsed=[UNLIT],
        meshes=[{"name": "layers", "primitives": primitives}],
        textures=[{"source": 0, "sampler": 0}],
        images=[{"name": "layers", "mimeType": "image/png", "bufferView": picture}],
    )


def posed(level: AssetLevel, frame: int) -> AssetLevel:
    """The layers as they stand over a torso in a frame, in the head's own frame."""
    track = level.track
    if track is None or track.torso is None:
        return level
    moved = (replace(one, vertices=track.posed(one.vertices, frame).astype(np.float32)) for one in level.layers)
    return replace(level, layers=tuple(moved))


def write_document(path: Path, name: str, builder: Builder, nodes: Sequence[dict[str, Any]], **parts: Any) -> int:
    """Write a file with the arrays of `builder`; returns its bytes.

    Args:
        name: of the root node, the last one's parent.
        parts: what else the document has.
    """
    document = {
        "asset": {"version": "2.0", "generator": "facefolds"},
        "scene": 0,
        "scenes": [{"nodes": [len(nodes)]}],
        "nodes": [*nodes, {"name": name, "rotation": TO_Y_UP, "children": [len(nodes) - 1]}],
        "materials": _materials(),
        "samplers": [SAMPLER],
        **parts,
        "accessors": builder.accessors,
        "bufferViews": builder.views,
        "buffers": [{"byteLength": len(builder.binary)}],
    }
    data = container(document, bytes(builder.binary))
    with atomic_file(path) as temporary:
        temporary.write_bytes(data)
    return len(data)


@dataclass(frozen=True)
class Triangles:
    """All layers' vertices in one list, with the triangles of the still.

    Attributes:
        vertices: (V, 3), those of the outermost layer first.
        st: (V, 2) in the picture of all layers.
        core: (F, 3) that show opaque texels.
        shell: (F, 3) that show anything, as they are drawn: of the innermost layer first, from the back to the front.
    """

    vertices: NDArray[np.float32]
    st: NDArray[np.float64]
    core: NDArray[np.intp]
    shell: NDArray[np.intp]


def triangles_of(level: AssetLevel, textures: Sequence[NDArray[np.uint8]]) -> Triangles:
    """What a still is drawn of.

    Args:
        textures: of each layer, as `opaque_where_covered` made them.
    """
    _, _, width, height = level.entry.texture.colour_rect
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in level.layers])
    st, core, shell = [], [], []
    for mesh, layer, texture, start in zip(level.layers, level.entry.layers, textures, starts, strict=False):
        x, y, w, h = layer.texture_rect
        st.append((mesh.st * (w, h) + (x, y)) / (width, height))
        core.append(mesh.faces[faces_over(mesh, texture[..., 3] == 255)].astype(np.intp) + start)
        seen = faces_over(mesh, texture[..., 3] > 0)
        shown = TexturedMesh(mesh.vertices, mesh.faces[seen], mesh.st)
        shell.append(back_to_front(shown).astype(np.intp) + start)
    vertices = np.concatenate([mesh.vertices for mesh in level.layers])
    return Triangles(vertices, np.concatenate(st), np.concatenate(core), np.concatenate(shell[::-1]))


def _primitives(builder: Builder, level: AssetLevel, triangles: Triangles) -> list[dict[str, Any]]:
    """The core's triangles and the shell's, over the same vertices."""
    uv = [
        st_to_uv(mesh.st.astype(np.float64), window) for mesh, window in zip(level.layers, level.windows, strict=True)
    ]
    chart = np.concatenate([np.stack([(one[:, 1] + 2) / 4, (2 - one[:, 0]) / 4], -1) for one in uv])
    attributes = {
        "POSITION": builder.array("VEC3", triangles.vertices, bounds=True),
        "TEXCOORD_0": builder.array("VEC2", triangles.st),
        "TEXCOORD_1": builder.array("VEC2", chart),
    }
    parts = [triangles.core, triangles.shell]
    return [
        {"attributes": attributes, "indices": builder.indices(part), "material": index}
        for index, part in enumerate(parts)
        if len(part)
    ]


def picture_of(level: AssetLevel, textures: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """All layers in one RGBA picture, where the asset's colour image has them, with gutters."""
    _, _, width, height = level.entry.texture.colour_rect
    picture = np.zeros((height, width, 4), np.uint8)
    for texture, layer in zip(textures, level.entry.layers, strict=True):
        x, y, w, h = layer.texture_rect
        left, top, right, below = (min(GUTTER, room) for room in (x, y, width - x - w, height - y - h))
        padded = np.pad(texture, ((top, below), (left, right), (0, 0)), mode="edge")
        picture[y - top : y + h + below, x - left : x + w + right] = padded
    return picture


def pose_of(track: Track, frame: int) -> dict[str, list[float]]:
    """Of a node: where the head stands in a frame."""
    w, x, y, z = track.quaternions[frame].tolist()
    return {"rotation": [x, y, z, w], "translation": track.translations[frame].tolist()}


def _materials() -> list[dict[str, Any]]:
    """Of core and shell: unlit, the first texture, without backs."""
    modes: dict[str, dict[str, Any]] = {
        "core": {"alphaMode": "MASK", "alphaCutoff": CUTOFF},
        "shell": {"alphaMode": "BLEND"},
    }
    colour = {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 1.0}
    return [
        {"name": name, **mode, "doubleSided": False, "pbrMetallicRoughness": colour, "extensions": {UNLIT: {}}}
        for name, mode in modes.items()
    ]


def back_to_front(mesh: TexturedMesh) -> NDArray[np.int32]:
    """The faces, farthest from a viewer before the face (+x) first: nearer folds of a sheet are drawn over farther."""
    depth = mesh.vertices[mesh.faces, 0].mean(1)
    return mesh.faces[np.argsort(depth, kind="stable")]


def png(texture: NDArray[np.uint8]) -> bytes:
    """A picture's file."""
    buffer = io.BytesIO()
    Image.fromarray(texture).save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def container(document: dict[str, Any], binary: bytes) -> bytes:
    """The GLB container: a header and two chunks, each padded to 4 bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
