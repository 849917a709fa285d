"""A reader of EXT_layered_volumetric_video written from its text alone: nothing of facefolds is imported. Slow, plain.

Libraries: DracoPy for the meshes, PyAV for the video's planes, Pillow for the PNG. What any renderer has (nearest hits,
interpolated chroma, bilinear look-ups in a rectangle) is that of the reader of assets.
"""

from __future__ import annotations

import io
import json
import struct
from typing import Any

import av
import DracoPy
import numpy as np
from PIL import Image

from tests.asset.independent_reader import bilinear, nearest, upsampled

NAME, VIDEO, DRACO = "EXT_layered_volumetric_video", "KHR_texture_video", "KHR_draco_mesh_compression"
Array = np.ndarray


class Face:
    """The first node with the extension.

    Args:
        data: a GLB.
    """

    def __init__(self, data: bytes) -> None:
        (size,) = struct.unpack_from("<I", data, 12)
        self.json, self.binary = json.loads(data[20 : 20 + size]), data[28 + size :]
        self.index = next(i for i, node in enumerate(self.json["nodes"]) if NAME in node.get("extensions", {}))
        self.said: dict[str, Any] = self.json["nodes"][self.index]["extensions"][NAME]
        self.meshes = [self._mesh(one) for one in self.json["meshes"][self.said["mesh"]]["primitives"]]

    def view(self, index: int) -> bytes:
        one = self.json["bufferViews"][index]
        start = one.get("byteOffset", 0)
        return self.binary[start : start + one["byteLength"]]

    def _mesh(self, primitive: dict[str, Any]) -> tuple[Array, Array, Array]:
        one = primitive["extensions"][DRACO]
        mesh = DracoPy.decode(self.view(one["bufferView"]))
        position, st = (
            mesh.get_attribute_by_unique_id(one["attributes"][name])["data"] for name in ("POSITION", "TEXCOORD_0")
        )
        return np.asarray(position, float), np.asarray(mesh.faces), np.asarray(st, float)

    def pictures(self) -> list[Array]:
        """All frames: (height, width, 3), stored RGB in [0, 1] rounded to 8 bits, red being the luma under alpha."""
        source = self.json["textures"][self.said["textures"][0]]["extensions"][VIDEO]["source"]
        video = self.view(self.json["extensions"][VIDEO]["videos"][source]["bufferView"])
        with av.open(io.BytesIO(video)) as container:
            return [self._rgb(frame.to_ndarray().astype(float)) for frame in container.decode(video=0)]

    def _rgb(self, planes: Array) -> Array:
        height, width = self.said["height"], self.said["width"]
        cb, cr = (upsampled(plane) for plane in planes[height:].reshape(2, height // 2, width // 2))
        y, b, r = (planes[:height] - 16) / 219, (cb - 128) / 224, (cr - 128) / 224
        red, blue = y + 1.5748 * r, y + 1.8556 * b
        rgb = np.stack([red, (y - 0.2126 * red - 0.0722 * blue) / 0.7152, blue], -1)
        return np.rint(255 * np.clip(rgb, 0, 1)) / 255

    def to_gltf(self, frame: int) -> Array:
        """(4, 4): the node's own axes -> those of the scene, in a frame."""
        parents = {child: i for i, node in enumerate(self.json["nodes"]) for child in node.get("children", [])}
        matrix, index = np.eye(4), self.index
        while True:
            node = self.json["nodes"][index]
            if index == self.index:
                node = node | self._pose(frame)
            matrix = placed(node) @ matrix
            if index not in parents:
                return matrix
            index = parents[index]

    def _pose(self, frame: int) -> dict[str, Array]:
        if "animation" not in self.said:
            return {}
        one, found = self.json["animations"][self.said["animation"]], {}
        for channel in one["channels"]:
            accessor = self.json["accessors"][one["samplers"][channel["sampler"]]["output"]]
            values = np.frombuffer(self.view(accessor["bufferView"]), "<f4").reshape(accessor["count"], -1)
            found[channel["target"]["path"]] = values[frame].astype(float)
        return found

    def _staying(self, x: Array, frame: int) -> Array:
        """Vertices (V, 3) of the layers, some of which stay while the node moves, in the node's own axes."""
        if "torso" not in self.said:
            return x
        one = self.said["torso"]
        share = np.clip((x @ one["normal"] - one["offset"]) / one["band"], 0, 1)[:, None]
        matrix = np.linalg.inv(placed(self._pose(frame))) @ placed(one)
        return x + share * (x @ matrix[:3, :3].T + matrix[:3, 3] - x)

    def render(self, eye: Array, rays: Array, frame: int, background: float | Array, picture: Array) -> Array:
        """Colors (M, 3) along unit rays (M, 3) from an eye, both in the scene's axes, of one of `pictures`."""
        inward = np.linalg.inv(self.to_gltf(frame))
        eye, rays = inward[:3, :3] @ eye + inward[:3, 3], rays @ inward[:3, :3].T
        color, through = np.zeros((len(rays), 3)), np.ones(len(rays))
        (X, Y, _, _), (A, B, _, _) = self.said["colorRectangle"], self.said["alphaRectangle"]
        for layer, (mesh, (x, y, w, h)) in enumerate(zip(self.meshes, self.said["rectangles"], strict=True)):
            hit, st = nearest(eye, rays, self._staying(mesh[0], frame), *mesh[1:])
            own = bilinear(picture[Y + y : Y + y + h, X + x : X + x + w], st)
            alpha = bilinear(picture[B + y : B + y + h, A + x : A + x + w], st)[:, 0]
            if "reflection" in self.said:
                own = np.clip(own + self._reflected(layer, st, rays[hit], frame), 0, 1)
            color[hit] += (through[hit] * alpha)[:, None] * own
            through[hit] *= 1 - alpha
        return color + background * through[:, None]

    def _reflected(self, layer: int, st: Array, d: Array, frame: int) -> Array:
        one = self.said["reflection"]
        image = self.json["images"][self.json["textures"][one["texture"]]["source"]]
        codes = np.asarray(Image.open(io.BytesIO(self.view(image["bufferView"]))), float)

        def read(name: str, at: Array) -> Array:
            x, y, w, h = one[f"{name}Rectangle"]
            return bilinear(codes[y : y + h, x : x + w], at)

        a, b, c, e = one["transforms"][layer]
        at = st * (a, b) + (c, e)
        n = read("normals", at) / 127.5 - 1
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        r = d - 2 * np.minimum((d * n).sum(1), 0)[:, None] * n
        r = r @ placed({"rotation": self._pose(frame).get("rotation", (0, 0, 0, 1))})[:3, :3].T
        long = np.sqrt(np.maximum(2 * (1 + r[:, 0]), 1e-6))
        light = read("environment", np.stack([0.5 + 0.5 * r[:, 1] / long, 0.5 - 0.5 * r[:, 2] / long], -1))
        gloss = one["glossScale"] * read("gloss", at)[:, :1] / 255
        return gloss * one["environmentScale"] * light / 255 - one["offsetScale"] * (read("offset", at) / 127.5 - 1)


def placed(node: dict[str, Any]) -> Array:
    """(4, 4) of a node's translation and rotation (x, y, z, w)."""
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
