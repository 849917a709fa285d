"""An asset's reflection as Blender's shader nodes: docs/reference/asset-format.md, "Reflection", node by node.

A GLB cannot hold it. It is read from the asset's folder: the manifest and the picture that the full level names.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

CHART = "UVMap.001"
"""What Blender's importer calls TEXCOORD_1: the place on the model's UV map."""


@dataclass
class Gloss:
    """Of an asset.

    Attributes:
        entry: the manifest's `reflection`.
        image: the picture, stored values.
    """

    entry: dict[str, Any]
    image: Any


def read_gloss(asset: Path) -> Gloss | None:
    """Of an asset's full level; None where it has none. After `read_factory_settings`, which forgets images."""
    level = json.loads((asset / "manifest.json").read_text())["levels"][-1]
    entry = level.get("reflection")
    if entry is None:
        return None
    image = bpy.data.images.load(str((asset / entry["file"]).resolve()))
    image.colorspace_settings.name = "Non-Color"
    return Gloss(entry, image)


class Nodes:
    """Formulas as nodes of a tree. Operands are numbers, triples or sockets."""

    def __init__(self, tree: Any) -> None:
        self.tree = tree

    def _node(self, kind: str, operation: str, operands: tuple[Any, ...]) -> Any:
        node = self.tree.nodes.new(kind)
        node.operation = operation
        for socket, operand in zip(node.inputs, operands, strict=False):
            if isinstance(operand, bpy.types.NodeSocket):
                self.tree.links.new(operand, socket)
            else:
                socket.default_value = operand
        return node

    def number(self, operation: str, *operands: Any) -> Any:
        return self._node("ShaderNodeMath", operation, operands).outputs[0]

    def vector(self, operation: str, *operands: Any) -> Any:
        node = self._node("ShaderNodeVectorMath", operation, operands)
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def scaled(self, vector: Any, factor: Any) -> Any:
        node = self._node("ShaderNodeVectorMath", "SCALE", (vector,))
        if isinstance(factor, bpy.types.NodeSocket):
            self.tree.links.new(factor, node.inputs["Scale"])
        else:
            node.inputs["Scale"].default_value = factor
        return node.outputs["Vector"]

    def parts(self, vector: Any) -> tuple[Any, Any, Any]:
        node = self.tree.nodes.new("ShaderNodeSeparateXYZ")
        self.tree.links.new(vector, node.inputs[0])
        return node.outputs[0], node.outputs[1], node.outputs[2]

    def joined(self, x: Any, y: Any, z: Any) -> Any:
        node = self.tree.nodes.new("ShaderNodeCombineXYZ")
        for socket, operand in zip(node.inputs, (x, y, z), strict=True):
            if isinstance(operand, bpy.types.NodeSocket):
                self.tree.links.new(operand, socket)
            else:
                socket.default_value = operand
        return node.outputs[0]

    def turned(self, vector: Any, before: str, after: str) -> Any:
        """A direction from WORLD to OBJECT, or the other way."""
        node = self.tree.nodes.new("ShaderNodeVectorTransform")
        node.vector_type, node.convert_from, node.convert_to = "VECTOR", before, after
        self.tree.links.new(vector, node.inputs[0])
        return node.outputs[0]


def reflected(tree: Any, colour: Any, gloss: Gloss) -> Any:
    """The socket of the layers' colour with its reflection, of a mesh that Blender's importer read from a GLB."""
    nodes, entry = Nodes(tree), gloss.entry
    chart = tree.nodes.new("ShaderNodeUVMap")
    chart.uv_map = CHART
    across, up, _ = nodes.parts(chart.outputs["UV"])  # (v + 2) / 4 and, as the importer turns it, (u + 2) / 4
    u0, u1, v0, v1 = entry["uv_window"]
    s = nodes.number("MULTIPLY_ADD", across, 4 / (v1 - v0), (-2 - v0) / (v1 - v0))
    t = nodes.number("MULTIPLY_ADD", up, -4 / (u1 - u0), (u1 + 2) / (u1 - u0))

    def look(name: str, s: Any, t: Any) -> Any:
        x, y, width, height = entry[f"{name}_rect"]
        inside = [
            nodes.number("MINIMUM", nodes.number("MAXIMUM", nodes.number("MULTIPLY", at, size), 0.5), size - 0.5)
            for at, size in ((s, width), (t, height))
        ]
        column = nodes.number("DIVIDE", nodes.number("ADD", inside[0], x), entry["width"])
        row = nodes.number("SUBTRACT", 1.0, nodes.number("DIVIDE", nodes.number("ADD", inside[1], y), entry["height"]))
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image, texture.extension, texture.interpolation = gloss.image, "EXTEND", "Linear"
        tree.links.new(nodes.joined(column, row, 0.0), texture.inputs["Vector"])
        return texture.outputs["Color"]

    def signed(name: str) -> Any:
        return nodes.vector("MULTIPLY_ADD", look(name, s, t), (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))

    # Where the head has a pose, the normals turn with it and the light of the room does not.
    incoming = tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"]
    x, y, z = nodes.parts(nodes.turned(nodes.scaled(incoming, -1.0), "WORLD", "OBJECT"))
    along = nodes.joined(x, z, nodes.number("MULTIPLY", y, -1.0))  # the importer has turned (x, y, z) into (x, -z, y)
    normal = nodes.vector("NORMALIZE", signed("normals"))
    towards = nodes.number("MINIMUM", nodes.vector("DOT_PRODUCT", along, normal), 0.0)
    mirrored = nodes.vector("SUBTRACT", along, nodes.scaled(normal, nodes.number("MULTIPLY", towards, 2.0)))
    x, y, z = nodes.parts(mirrored)
    x, y, z = nodes.parts(nodes.turned(nodes.joined(x, nodes.number("MULTIPLY", z, -1.0), y), "OBJECT", "WORLD"))
    ahead, left = nodes.number("MULTIPLY", y, -1.0), x  # of the asset: the scene's subject looks to -y
    wide = nodes.number("MAXIMUM", nodes.number("MULTIPLY", nodes.number("ADD", ahead, 1.0), 2.0), 1e-6)
    scale = nodes.number("DIVIDE", 0.5, nodes.number("SQRT", wide))
    across = nodes.number("MULTIPLY_ADD", left, scale, 0.5)
    down = nodes.number("SUBTRACT", 0.5, nodes.number("MULTIPLY", z, scale))
    light = nodes.scaled(look("environment", across, down), entry["environment_scale"])
    strength = nodes.number("MULTIPLY", nodes.parts(look("gloss", s, t))[0], entry["gloss_scale"])
    added = nodes.vector(
        "SUBTRACT", nodes.scaled(light, strength), nodes.scaled(signed("offset"), entry["offset_scale"])
    )
    bright = nodes.vector("MAXIMUM", nodes.vector("ADD", colour, added), (0.0, 0.0, 0.0))
    return nodes.vector("MINIMUM", bright, (1.0, 1.0, 1.0))
