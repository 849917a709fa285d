"""What the extension says on a node of a glTF file, as validated models; the JSON schema is made from them.

python -c "from facefolds_core.asset.gltf.extension import write_schema; write_schema(FOLDER)"
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field
from pydantic.alias_generators import to_camel

from facefolds_core.asset.manifest_base import (
    Count,
    Maybe,
    Part,
    RateTerm,
    Rect,
    Row,
    Scale,
    Sha256,
    Vector,
    without_absent,
)
from facefolds_core.files.writing import write_json

NAME = "EXT_layered_volumetric_video"
TEXTURE_VIDEO, DRACO = "KHR_texture_video", "KHR_draco_mesh_compression"
SCHEMA = f"node.{NAME}.schema.json"
MOST_LAYERS = 256
Index = Annotated[int, Field(ge=0, le=2**31 - 1)]
"""Of an entry of one of glTF's arrays."""


class GltfPart(Part):
    """Base: keys as glTF writes them, colorRectangle for color_rectangle."""

    model_config = ConfigDict(alias_generator=to_camel, populate_by_name=True)


class Reflection(GltfPart):
    """What gloss adds to the colors by the direction of view. A reader may ignore it.

    Attributes:
        texture: index of a texture whose RGB image holds four small images.
        transforms: [a, b, c, d] of each layer: its (s, t) is (a s + c, b t + d) in gloss, offset and normals.
        environment_rectangle: [x, y, width, height] of the light by direction, pixels of the image.
        gloss_rectangle: [x, y, width, height] of the share of the light that a place reflects.
        offset_rectangle: [x, y, width, height] of what is taken off: the video's colors are means over directions.
        normals_rectangle: [x, y, width, height] of the surface's normals.
        environment_scale: the light that code 255 stands for.
        gloss_scale: the share that code 255 stands for.
        offset_scale: the color that code 255 stands for; code 0 stands for its negative.
    """

    texture: Index
    transforms: Annotated[tuple[Row, ...], Field(min_length=1, max_length=MOST_LAYERS)]
    environment_rectangle: Rect
    gloss_rectangle: Rect
    offset_rectangle: Rect
    normals_rectangle: Rect
    environment_scale: Scale
    gloss_scale: Scale
    offset_scale: Scale

    def rectangles(self) -> dict[str, Rect]:
        """By their keys."""
        names = ("environment_rectangle", "gloss_rectangle", "offset_rectangle", "normals_rectangle")
        return {to_camel(name): getattr(self, name) for name in names}


class NodeTorso(GltfPart):
    """What stays while the animation moves the node: all beyond a plane, as shoulders do. A reader may ignore it.

    Attributes:
        normal: of the plane, of unit length, towards what stays; in the node's own axes.
        offset: along the normal, where vertices begin to stay.
        band: behind the plane, within which they come to stay.
        rotation: of the node in the pose in which they stay, x, y, z, w.
        translation: of the node in that pose.
    """

    normal: Vector
    offset: float
    band: Scale
    rotation: tuple[float, float, float, float]
    translation: Vector


class Checksum(GltfPart):
    """What a part of the file must be.

    Attributes:
        buffer_view: index of the buffer view.
        sha256: of its bytes, in hexadecimal.
    """

    buffer_view: Index
    sha256: Sha256


class LayeredVideo(GltfPart):
    """Nested, semi-transparent meshes and a video with the color and opacity of each.

    Attributes:
        mesh: index of the mesh whose primitives are the layers, outermost first.
        textures: indices of textures with KHR_texture_video: the same pictures; a reader takes the first it can decode.
        width: of the decoded picture, pixels.
        height: of the decoded picture, pixels.
        color_rectangle: [x, y, width, height] of the color image in the picture.
        alpha_rectangle: [x, y, width, height] of the alpha image in the picture, as large as the color image.
        rectangles: [x, y, width, height] of each layer, in the color image and, the same, in the alpha image.
        frames: number of pictures.
        frame_rate: numerator and denominator of the pictures a second.
        still_frame: the frame that the node's own mesh shows.
        animation: index of the animation that moves the node with the video.
        torso: what stays meanwhile.
        reflection: gloss.
        checksums: of buffer views of this file.
    """

    mesh: Index
    textures: Annotated[tuple[Index, ...], Field(min_length=1)]
    width: Count
    height: Count
    color_rectangle: Rect
    alpha_rectangle: Rect
    rectangles: Annotated[tuple[Rect, ...], Field(min_length=1, max_length=MOST_LAYERS)]
    frames: Count
    frame_rate: tuple[RateTerm, RateTerm]
    still_frame: Annotated[int, Field(ge=0)] = 0
    animation: Maybe[Index] = None
    torso: Maybe[NodeTorso] = None
    reflection: Maybe[Reflection] = None
    checksums: Maybe[Annotated[tuple[Checksum, ...], Field(min_length=1)]] = None

    @property
    def rate(self) -> Fraction:
        """Pictures a second."""
        return Fraction(*self.frame_rate)


def schema() -> dict[str, Any]:
    """The JSON schema of the object that the extension adds to a node."""
    made = LayeredVideo.model_json_schema(mode="serialization", by_alias=True)
    without_absent(made)
    _optional(made)
    for part in made["$defs"].values():
        _optional(part)
    title = f"{NAME} node extension"
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA} | made | {"title": title}


def _optional(part: dict[str, Any]) -> None:
    """Keys with a default may be left out; the lines of a class about its attributes describe the keys."""
    keys = part["properties"]
    part["required"] = [name for name in part["required"] if "default" not in keys[name]]
    part["description"], _, attributes = part["description"].partition("\n\nAttributes:\n")
    for line in attributes.splitlines():
        name, _, words = line.strip().partition(": ")
        keys[to_camel(name)]["description"] = f"{words[:1].upper()}{words[1:]}"


def write_schema(folder: Path) -> None:
    """Write the schema again, after a change of the models."""
    write_json(folder / SCHEMA, schema())
