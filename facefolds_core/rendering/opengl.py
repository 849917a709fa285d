"""The fast renderer: the reference renderer's picture by OpenGL 3.3, without a screen (moderngl, EGL).

Layers are drawn from the innermost to the outermost with ordinary blending into a float32 picture. Each has its own
slice of the depth range, nearer than those inside it, so layers never hide each other; and each first goes to depth
alone, then its colour where depth is equal, so that its folds count once.
"""

from __future__ import annotations

import sys
from typing import Any

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.reflections import ReflectionMaps, window_to_window
from facefolds_core.rendering.reference import BLACK, Image, Layered, room_from, seen_from, track_of

VERTEX = """
#version 330
uniform mat4 projection; // clip coordinates of a world point
uniform vec2 slice; // of the depth range [-1, 1]: half its size, its middle
uniform vec4 torso; // normal and offset of the plane from which on points stay in the room while the head turns
uniform float band; // within which they come to stay; 0: nothing does
uniform mat4 stay; // where these are, in the layers' own axes
in vec3 position;
in vec2 corner_st;
out vec2 st;
out vec3 point;
invariant gl_Position; // the same depth in both passes
void main() {
  st = corner_st;
  point = position;
  if (band > 0.0) {
    float share = clamp((dot(torso.xyz, position) - torso.w) / band, 0.0, 1.0);
    point = mix(position, (stay * vec4(position, 1.0)).xyz, share);
  }
  gl_Position = projection * vec4(point, 1.0);
  gl_Position.z = slice.x * gl_Position.z + slice.y * gl_Position.w;
}
"""
FRAGMENT = """
#version 330
uniform sampler2D picture;
in vec2 st;
out vec4 colour;
void main() { colour = texture(picture, st); }
"""
FRAGMENT_WITH_REFLECTION = """
#version 330
uniform sampler2D picture;
uniform sampler2D added; // offset, gloss
uniform sampler2D normals;
uniform sampler2D environment;
uniform vec4 to_maps; // (s, t) of the layer -> that of the maps: times xy, plus zw
uniform vec3 eye;
uniform mat3 to_room; // from the meshes' own axes to those of the room, which the light is fixed to
in vec2 st;
in vec3 point;
out vec4 colour;
void main() {
  vec2 at = st * to_maps.xy + to_maps.zw;
  vec4 here = texture(added, at);
  vec3 normal = normalize(texture(normals, at).rgb);
  vec3 along = normalize(point - eye);
  vec3 r = to_room * (along - 2.0 * min(dot(along, normal), 0.0) * normal);
  vec2 place = 0.5 + 0.5 * vec2(r.y, -r.z) / sqrt(max(2.0 * (1.0 + r.x), 1e-6));
  colour = texture(picture, st);
  colour.rgb = clamp(colour.rgb + here.a * texture(environment, place).rgb - here.rgb, 0.0, 1.0);
}
"""
NOTHING = """
#version 330
out vec4 colour;
void main() { colour = vec4(0.0); }
"""
STRAIGHT_OVER: Any = (moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA)
"""Straight alpha in; what is stored is premultiplied: rgb of the layers alone, alpha their opacity together."""
_MARGIN = 0.01
"""By how much the near and the far plane stay away from the nearest and the farthest vertex, of its depth."""
_NEAREST = 1e-3


class OpenGLRenderer:
    """Renders pictures of one asset. Use it in a `with` block: it holds memory of the graphics card.

    Args:
        asset: its meshes go to the card at once, textures as frames are asked for.
        maps: the reflection, of an asset with `windows`; None for none.

    Raises:
        UserError: if there is no OpenGL here.
    """

    def __init__(self, asset: Layered, maps: ReflectionMaps | None = None) -> None:
        self._asset = asset
        self._context = _make_context()
        self._colour = self._context.program(VERTEX, FRAGMENT if maps is None else FRAGMENT_WITH_REFLECTION)
        self._depth = self._context.program(VERTEX, NOTHING)
        self._layers = [self._upload(layer) for layer in asset.layers]
        self._reflections: list[tuple[str, moderngl.Texture]] = []
        self._to_maps: list[bytes] = []
        if maps is not None:
            level: Any = asset
            self._reflections = self._upload_reflection(maps)
            self._to_maps = [np.array(window_to_window(one, maps.window), "f4").tobytes() for one in level.windows]
        self._vertices = np.concatenate([layer.vertices for layer in asset.layers]).astype(np.float64)
        self._frame = -1
        self._textures: list[moderngl.Texture] = []
        self._target: tuple[tuple[int, int], moderngl.Framebuffer] | None = None

    def __enter__(self) -> OpenGLRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.release()

    @property
    def device(self) -> str:
        """What renders, in the driver's words."""
        return str(self._context.info["GL_RENDERER"])

    def render(self, camera: Camera, frame: int, background: ArrayLike = BLACK) -> tuple[Image, Image]:
        """One ray a pixel: rgb (H, W, 3) and alpha (H, W), float32 in [0, 1], of frame `frame`.

        Args:
            camera: in the world; an asset with a track stands there as it did in that frame.
            background: RGB in [0, 1], (3,) or (H, W, 3).

        Raises:
            UserError: if the picture is larger than the card allows.
        """
        to_room = room_from(self._asset, frame)
        camera = seen_from(self._asset, camera, frame)
        self._show_frame(frame)
        target = self._sized_target(camera)
        _write(target, colour=True, depth=True)
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        track = track_of(self._asset)
        points = self._vertices if track is None else track.posed(self._vertices, frame)
        projection = _projection(camera, points).T.astype("f4").tobytes()
        for program in (self._depth, self._colour):
            _uniform(program, "projection").write(projection)
            self._set_torso(program, frame)
        for unit, (name, texture) in enumerate(self._reflections, 1):
            _uniform(self._colour, name).value = unit
            texture.use(unit)
        if self._reflections:
            _uniform(self._colour, "eye").write(camera.centre.astype("f4").tobytes())
            _uniform(self._colour, "to_room").write(to_room.T.astype("f4").tobytes())
        count = len(self._layers)
        for index in reversed(range(count)):
            # NDC depth from -1 (outermost layer) to 1; a little is left free between slices.
            slice_ = np.array([0.99 / count, (2 * index + 1) / count - 1], "f4").tobytes()
            for program in (self._depth, self._colour):
                _uniform(program, "slice").write(slice_)
            if self._to_maps:
                _uniform(self._colour, "to_maps").write(self._to_maps[index])
            self._draw_layer(target, *self._layers[index], self._textures[index])
        data = np.frombuffer(target.read(components=4, dtype="f4"), np.float32)
        rgba = data.reshape(camera.height, camera.width, 4)[::-1]
        alpha = np.clip(rgba[..., 3], 0, 1)
        rgb = rgba[..., :3] + (1 - alpha)[..., None] * np.asarray(background, np.float32)
        return np.asarray(rgb, np.float32), alpha

    def _set_torso(self, program: moderngl.Program, frame: int) -> None:
        track = track_of(self._asset)
        torso = None if track is None else track.torso
        _uniform(program, "band").value = 0.0 if torso is None else torso.band
        if track is None or torso is None:
            return
        stay, shift = np.eye(4), torso.shift(track.at(frame))
        stay[:3, :3], stay[:3, 3] = shift.rotation, shift.translation
        _uniform(program, "torso").write(np.array([*torso.normal, torso.offset], "f4").tobytes())
        _uniform(program, "stay").write(stay.T.astype("f4").tobytes())

    def _draw_layer(
        self,
        target: moderngl.Framebuffer,
        depth_pass: moderngl.VertexArray,
        colour_pass: moderngl.VertexArray,
        texture: moderngl.Texture,
    ) -> None:
        context = self._context
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = "<"
        _write(target, colour=False, depth=True)
        depth_pass.render()
        _write(target, colour=True, depth=False)
        context.enable(moderngl.BLEND)
        context.blend_func = STRAIGHT_OVER
        context.depth_func = "=="
        texture.use()
        colour_pass.render()

    def _upload(self, layer: Any) -> tuple[moderngl.VertexArray, moderngl.VertexArray]:
        corners = np.concatenate([layer.vertices, layer.st], 1).astype("f4")
        vertices = self._context.buffer(corners.tobytes())
        indices = self._context.buffer(np.asarray(layer.faces, "i4").tobytes())
        depth = self._context.vertex_array(self._depth, [(vertices, "3f 2x4", "position")], indices)
        colour = self._context.vertex_array(self._colour, [(vertices, "3f 2f", "position", "corner_st")], indices)
        return depth, colour

    def _upload_reflection(self, maps: ReflectionMaps) -> list[tuple[str, moderngl.Texture]]:
        """Names of the samplers, and what they read."""
        images = {
            "added": np.concatenate([maps.offset, maps.gloss[..., None]], -1),
            "normals": maps.normals,
            "environment": maps.environment,
        }
        return [(name, _upload_image(self._context, image)) for name, image in images.items()]

    def _show_frame(self, frame: int) -> None:
        if frame == self._frame:
            return
        for texture in self._textures:
            texture.release()
        self._textures = [_upload_image(self._context, texture) for texture in self._asset.frame(frame)]
        self._frame = frame

    def _sized_target(self, camera: Camera) -> moderngl.Framebuffer:
        size = (camera.width, camera.height)
        if self._target and self._target[0] == size:
            return self._target[1]
        largest = int(self._context.info["GL_MAX_RENDERBUFFER_SIZE"])
        if max(size) > largest:
            raise UserError(
                "the picture is too large",
                expected=f"at most {largest} pixels a side ({self.device})",
                found=f"{size[0]} x {size[1]}",
                remedy="ask for a smaller size",
            )
        if self._target:
            self._target[1].release()
        colour = self._context.renderbuffer(size, 4, dtype="f4")
        target = self._context.framebuffer([colour], self._context.depth_renderbuffer(size))
        self._target = (size, target)
        return target


def _make_context() -> moderngl.Context:
    """A context without a window. On Linux through EGL, by the names that the libraries have without -dev packages."""
    options: dict[str, Any] = {}
    if sys.platform.startswith("linux"):
        options = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    try:
        return moderngl.create_context(standalone=True, require=330, **options)
    except Exception as error:  # glcontext raises bare Exception
        raise UserError(
            "no OpenGL 3.3 on this machine",
            found=str(error),
            remedy="on Debian and Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri (no screen is needed)",
        ) from None


def _upload_image(context: moderngl.Context, image: NDArray[Any]) -> moderngl.Texture:
    """An image (H, W, C), uint8 or else as float32. Stored values as they are: no sRGB format. Row 0 is the top, as t
    runs."""
    height, width, channels = image.shape
    kind = "f1" if image.dtype == np.uint8 else "f4"
    data = np.ascontiguousarray(image, np.uint8 if kind == "f1" else np.float32).tobytes()
    texture = context.texture((width, height), channels, data, alignment=1, dtype=kind)
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    texture.repeat_x = texture.repeat_y = False
    return texture


def _write(target: moderngl.Framebuffer, colour: bool, depth: bool) -> None:
    """Draw to `target` from now on, to these of its parts; moderngl sets the masks when a target is put to use."""
    target.color_mask, target.depth_mask = (colour,) * 4, depth
    target.use()


def _uniform(program: moderngl.Program, name: str) -> moderngl.Uniform:
    uniform = program[name]
    assert isinstance(uniform, moderngl.Uniform)
    return uniform


def _projection(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4), world points to OpenGL's clip coordinates, near and far plane around `points` (V, 3).

    Pixel (i, j) has its centre at (i + 0.5, j + 0.5) from the top left corner, as in `Camera`.
    """
    depths = (points @ camera.rotation.T + camera.w2c[:, 3])[:, 2]
    far = max(2 * _NEAREST, float(depths.max()) * (1 + _MARGIN))
    near = max(_NEAREST, far / 1000, float(depths.min()) * (1 - _MARGIN))
    width, height, K = camera.width, camera.height, camera.K
    clip = np.zeros((4, 4))
    clip[0, :3] = 2 / width * K[0] - [0, 0, 1]
    clip[1, :3] = [0, 0, 1] - 2 / height * K[1]
    clip[2, 2:] = (far + near) / (far - near), -2 * far * near / (far - near)
    clip[3, 2] = 1
    return np.asarray(clip @ np.concatenate([camera.w2c, [[0, 0, 0, 1]]]))
