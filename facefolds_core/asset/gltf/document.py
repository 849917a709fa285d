"""A GLB taken apart, strictly: its container, and of its JSON what the extension rests on."""

from __future__ import annotations

import json
import struct
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.alias_generators import to_camel

from facefolds_core.asset.gltf.extension import Index
from facefolds_core.asset.manifest_base import Count, Offset, Vector

KINDS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
MOST_TOLD = 20
"""Problems of the JSON's form that are listed."""
MOST_SHOWN = 200
"""Characters of a problem of the JSON's form."""
T = TypeVar("T", bound=BaseModel)


class GlbError(ValueError):
    """What is wrong with a file, and where: a JSON pointer, or a byte.

    Args:
        place: e.g. "/nodes/0/mesh" or "byte 12".
        words: what is wrong.
    """

    def __init__(self, place: str, words: str) -> None:
        self.place, self.words = place, words
        super().__init__(f"{place}: {words}")


class Loose(BaseModel):
    """Base of glTF's objects: keys that are not looked at may be there, kinds are not converted."""

    model_config = ConfigDict(
        frozen=True, extra="ignore", strict=True, allow_inf_nan=False, alias_generator=to_camel, populate_by_name=True
    )

    extensions: dict[str, Any] = {}


class Header(Loose):
    """`asset`."""

    version: Literal["2.0"]


class Buffer(Loose):
    """The binary chunk, or a file beside."""

    byte_length: Count
    uri: str | None = None


class BufferView(Loose):
    """Some bytes of a buffer."""

    buffer: Index
    byte_offset: Offset = 0
    byte_length: Count
    byte_stride: Annotated[int, Field(ge=4, le=252, multiple_of=4)] | None = None


class Accessor(Loose):
    """Numbers in a buffer view."""

    buffer_view: Index | None = None
    byte_offset: Offset = 0
    component_type: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    normalized: bool = False
    count: Count
    type: str
    sparse: Any = None


class Primitive(Loose):
    """Triangles, here."""

    attributes: dict[str, Index]
    indices: Index | None = None
    mode: int = 4


class Mesh(Loose):
    """Primitives."""

    primitives: Annotated[tuple[Primitive, ...], Field(min_length=1)]


class Node(Loose):
    """What stands in a scene."""

    mesh: Index | None = None
    scale: Vector = (1.0, 1.0, 1.0)


class Texture(Loose):
    """An image, or a video by an extension."""

    source: Index | None = None


class Image(Loose):
    """A picture in a buffer view, or a file beside."""

    buffer_view: Index | None = None


class Target(Loose):
    """What a channel moves."""

    node: Index | None = None
    path: str


class Channel(Loose):
    """A sampler, and what it moves."""

    sampler: Index
    target: Target


class Sampler(Loose):
    """Times and values."""

    input: Index
    output: Index
    interpolation: str = "LINEAR"


class Animation(Loose):
    """Channels."""

    channels: tuple[Channel, ...]
    samplers: tuple[Sampler, ...]


class Gltf(Loose):
    """The JSON chunk."""

    asset: Header
    buffers: tuple[Buffer, ...] = ()
    buffer_views: tuple[BufferView, ...] = ()
    accessors: tuple[Accessor, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    nodes: tuple[Node, ...] = ()
    textures: tuple[Texture, ...] = ()
    images: tuple[Image, ...] = ()
    animations: tuple[Animation, ...] = ()
    extensions_used: tuple[str, ...] = ()
    extensions_required: tuple[str, ...] = ()

    def at(self, array: str, index: int, place: str) -> Any:
        """An entry of one of the arrays, by its name in Python.

        Raises:
            GlbError: if there is none, at `place`.
        """
        entries = getattr(self, array)
        if index >= len(entries):
            raise GlbError(place, f"there is no {to_camel(array)}[{index}]: there are {len(entries)}")
        return entries[index]


def validated(model: type[T], value: Any) -> T:
    """What an extension says, of the JSON as it was parsed.

    Raises:
        ValidationError: if it is not what the model takes.
    """
    return model.model_validate_json(json.dumps(value))


def in_words(error: ValidationError, place: str = "") -> list[str]:
    """What pydantic found, each with its place."""
    found = error.errors(include_url=False, include_context=False, include_input=False)
    told = []
    for one in found[:MOST_TOLD]:
        told.append(f"{'/'.join([place, *map(str, one['loc'])]) or '/'}: {one['msg']}"[:MOST_SHOWN])
    return told + [f"{place or '/'}: and {len(found) - MOST_TOLD} more"] * (len(found) > MOST_TOLD)


class Glb:
    """A file's JSON and binary chunk.

    Args:
        data: the file.

    Raises:
        GlbError: if the container is not whole. ValidationError: if the JSON is not glTF's.
    """

    def __init__(self, data: bytes) -> None:
        text, self.binary = chunks(data)
        self.gltf = Gltf.model_validate_json(text)

    def view(self, index: int, place: str) -> bytes:
        """The bytes of a buffer view.

        Raises:
            GlbError: if they are not in the file.
        """
        view: BufferView = self.gltf.at("buffer_views", index, place)
        here = f"/bufferViews/{index}"
        buffer: Buffer = self.gltf.at("buffers", view.buffer, f"{here}/buffer")
        if view.buffer != 0 or buffer.uri is not None:
            raise GlbError(f"{here}/buffer", "it is not in this file: all must lie in the first buffer")
        if buffer.byte_length > len(self.binary):
            words = f"{buffer.byte_length} bytes, the binary chunk has {len(self.binary)}"
            raise GlbError("/buffers/0/byteLength", words)
        end = view.byte_offset + view.byte_length
        if end > buffer.byte_length:
            raise GlbError(here, f"it ends at byte {end} of a buffer of {buffer.byte_length}")
        return self.binary[view.byte_offset : end]

    def numbers(self, index: int, place: str, kind: str) -> NDArray[Any]:
        """An accessor's values as they are stored: (count,) of SCALAR, else (count, n).

        Raises:
            GlbError: if they are not in the file, or of another kind.
        """
        accessor: Accessor = self.gltf.at("accessors", index, place)
        here = f"/accessors/{index}"
        if accessor.type != kind:
            raise GlbError(place, f"accessors[{index}] is {accessor.type[:20]}, {kind} is needed")
        if accessor.sparse is not None or accessor.buffer_view is None:
            raise GlbError(here, "it has no numbers of its own, or sparse ones, which the extension does not use")
        data = self.view(accessor.buffer_view, f"{here}/bufferView")
        width = KINDS[kind]
        dtype = np.dtype(COMPONENTS[accessor.component_type])
        stride = self.gltf.buffer_views[accessor.buffer_view].byte_stride or width * dtype.itemsize
        needed = accessor.byte_offset + (accessor.count - 1) * stride + width * dtype.itemsize
        if needed > len(data) or accessor.byte_offset % dtype.itemsize:
            raise GlbError(here, f"{accessor.count} entries end at byte {needed} of a view of {len(data)}")
        shape, strides = (accessor.count, width), (stride, dtype.itemsize)
        values = np.ndarray(shape, dtype, data, accessor.byte_offset, strides)
        return values[:, 0] if kind == "SCALAR" else values


def chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a GLB.

    Raises:
        GlbError: if it is none, or not whole.
    """
    if len(data) < 20 or data[:4] != b"glTF":
        raise GlbError("byte 0", "no GLB: it does not begin with glTF's header")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise GlbError("byte 4", f"version {version} of the container, 2 is needed")
    if length != len(data):
        raise GlbError("byte 8", f"the header says {length} bytes, the file has {len(data)}")
    found: list[bytes] = []
    place = 12
    for kind in (b"JSON", b"BIN\0"):
        if place == len(data) and found:
            return found[0], b""
        if place + 8 > len(data):
            raise GlbError(f"byte {place}", "a chunk's header is cut off")
        size, name = struct.unpack_from("<I4s", data, place)
        if name != kind or size % 4 or place + 8 + size > len(data):
            raise GlbError(f"byte {place}", f"no whole chunk {kind.decode().strip(chr(0))}")
        found.append(data[place + 8 : place + 8 + size])
        place += 8 + size
    return found[0], found[1]
