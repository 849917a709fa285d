"""Runs the Unity package's shaders without Unity: HLSL to SPIR-V to GLSL, drawn by OpenGL in the package's order."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.manifest import Reflection
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.engines._folder import rgb_picture
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.reflections import window_to_window
from tests.engines.unity_checks import SHADERS, run, spirv

Array = NDArray[np.float64]
TO_UNITY = np.array([[0.0, -1, 0], [0, 0, 1], [1, 0, 0]])
"""(x, y, z) of the asset -> (-y, z, x)."""
FLIP = np.diag([1.0, -1, -1])
"""A camera's own axes, OpenCV's -> OpenGL's, which Unity's view matrices have, too."""
DEFINES = ("SHADER_API_GLCORE", "UNITY_COLORSPACE_GAMMA")
NEAR, FAR = 0.05, 20.0


def glsl(shader: Path, place: Path) -> tuple[list[str], dict[str, int]]:
    """GLSL of vertices and pixels, and where in the block of uniforms each of them lies."""
    assert spirv(shader, place, DEFINES) == []
    codes = [
        run("spirv-cross", place / f"{stage}.spv", "--version", "430", "--no-es").stdout for stage in ("vert", "frag")
    ]
    listed = json.loads(run("spirv-cross", place / "vert.spv", "--reflect").stdout)["types"]
    block = next(one for one in listed.values() if one["name"] == "$Global")
    return codes, {member["name"]: member["offset"] for member in block["members"]}


def projection_of(camera: Camera) -> Array:
    """OpenGL's, of a camera in the middle of its picture."""
    w, h, K = camera.width, camera.height, camera.K
    depth = [(FAR + NEAR) / (NEAR - FAR), 2 * FAR * NEAR / (NEAR - FAR)]
    return np.array([[2 * K[0, 0] / w, 0, 0, 0], [0, 2 * K[1, 1] / h, 0, 0], [0, 0, *depth], [0, 0, -1, 0]])


def scene_uniforms(level: AssetLevel, camera: Camera, room: Array) -> dict[str, Array]:
    """What all layers share; the object stands where the world's axes are."""
    rotation, shift = FLIP @ camera.w2c[:, :3] @ TO_UNITY.T, FLIP @ camera.w2c[:, 3]
    points = np.concatenate([layer.vertices for layer in level.layers]) @ TO_UNITY.T
    low, high = points.min(0), points.max(0)
    turned = np.eye(4)
    turned[:3, :3] = room
    return {
        "unity_ObjectToWorld": np.eye(4),
        "unity_WorldToObject": np.eye(4),
        "unity_MatrixV": np.block([[rotation, shift[:, None]], [np.zeros(3), 1]]),
        "unity_MatrixP": projection_of(camera),
        "_WorldSpaceCameraPos": TO_UNITY @ camera.centre,
        "_Ball": np.array([*(low + high) / 2, np.linalg.norm(high - low) / 2]),
        "_Slices": np.array([len(level.layers)]),
        "_ToRoom": turned,
    }


def layer_uniforms(level: AssetLevel, index: int) -> dict[str, Array]:
    """As the package's `LayerObject` sets them."""
    texture, layer = level.entry.texture, level.entry.layers[index]
    x, y, w, h = layer.texture_rect
    size = np.array([texture.width, texture.height])

    def place(half: tuple[int, int, int, int]) -> Array:
        corner = np.array([half[0] + x, half[1] + y]) / size
        return np.array([w / size[0], -h / size[1], corner[0], 1 - corner[1]])

    found = {"_ColourPlace": place(texture.colour_rect), "_AlphaPlace": place(texture.alpha_rect)}
    found |= {"_Rect": np.array([x, y, w, h]), "_Slice": np.array([index])}
    return found | (reflection_uniforms(level.entry.reflection, layer.uv_window) if level.entry.reflection else {})


def reflection_uniforms(one: Reflection, window: tuple[float, float, float, float]) -> dict[str, Array]:
    rects = dict(zip(("_EnvironmentRect", "_GlossRect", "_OffsetRect", "_NormalsRect"), one.rects(), strict=True))
    return {name: np.array(rect) for name, rect in rects.items()} | {
        "_ReflectionSize": np.array([one.width, one.height, 0, 0]),
        "_ReflectionScales": np.array([one.environment_scale, one.gloss_scale, one.offset_scale, 0]),
        "_ToMaps": np.array(window_to_window(window, one.uv_window)),
    }


def drawn(level: AssetLevel, camera: Camera, frame: int, room: Array, background: float, place: Path) -> Array:
    """(H, W, 3) of a camera in the meshes' own frame."""
    context = moderngl.create_context(standalone=True, require=430, backend="egl")
    try:
        programs = {}
        for kind in ("Depth", "Colour"):
            codes, offsets = glsl(SHADERS / f"FacefoldsLayer{kind}.shader", place)
            programs[kind] = context.program(*codes)
        size = (camera.width, camera.height)
        target = context.framebuffer([context.texture(size, 4, dtype="f4")], context.depth_renderbuffer(size))
        target.use()
        target.clear(background, background, background, 1.0)
        images = textures(context, level, frame)
        shared = scene_uniforms(level, camera, room)
        for index in reversed(range(len(level.layers))):
            block = bytearray(max(offsets.values()) + 64)
            for name, value in (shared | layer_uniforms(level, index)).items():
                data = np.asarray(value, "<f4").T.tobytes()  # matrices column by column
                block[offsets[name] : offsets[name] + len(data)] = data
            buffer = context.buffer(bytes(block))
            buffer.bind_to_uniform_block(0)
            draw(context, target, programs, images, level, index)
        rows = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(camera.height, camera.width, 4)
        return rows[::-1, :, :3].astype(np.float64)
    finally:
        context.release()


def textures(context: moderngl.Context, level: AssetLevel, frame: int) -> dict[str, moderngl.Texture]:
    """Lowest row first, as Unity has them."""
    found = {"Picture": rgb_picture(list(level.pictures())[frame], level.entry.texture)}
    if level.entry.reflection:
        found["Reflection"] = np.asarray(Image.open(level.folder / level.entry.reflection.file).convert("RGB"))
    made = {}
    for name, picture in found.items():
        data = np.ascontiguousarray(picture[::-1]).tobytes()
        made[name] = context.texture((picture.shape[1], picture.shape[0]), 3, data, alignment=1)
        made[name].filter = moderngl.LINEAR, moderngl.LINEAR
        made[name].repeat_x = made[name].repeat_y = False
    return made


def draw(
    context: moderngl.Context,
    target: moderngl.Framebuffer,
    programs: dict[str, moderngl.Program],
    images: dict[str, moderngl.Texture],
    level: AssetLevel,
    index: int,
) -> None:
    """A layer by both of its materials, with the state that the .shader files ask for."""
    mesh = level.layers[index]
    corners = np.concatenate([mesh.vertices @ TO_UNITY.T, np.ones((len(mesh.vertices), 1)), mesh.st], 1)
    vertices, indices = (
        context.buffer(corners.astype("f4").tobytes()),
        context.buffer(mesh.faces.astype("i4").tobytes()),
    )
    for kind, program in programs.items():
        names = {name: program[name] for name in program if isinstance(program[name], moderngl.Uniform)}
        for unit, (name, texture) in enumerate(images.items()):
            texture.use(unit)
            sampler: Any = names.get(f"SPIRV_Cross_Combined_{name}linear_clamp")
            if sampler is not None:
                sampler.value = unit
        context.enable_only(moderngl.DEPTH_TEST | (moderngl.BLEND if kind == "Colour" else moderngl.NOTHING))
        context.depth_func = "<="
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        target.color_mask = (kind == "Colour",) * 4
        target.depth_mask = kind == "Depth"
        target.use()  # only then the masks count
        layout = "4f 2f" if kind == "Colour" else "4f 2x4"
        inputs = [name for name in ("v_position", "v_st") if name in program]
        context.vertex_array(program, [(vertices, layout if len(inputs) == 2 else "4f 2x4", *inputs)], indices).render()
