"""The reflection of a level on the graphics card, for `opengl`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.reader import AssetLevel
from facefolds_core.geometry.reflections import ReflectionMaps, window_to_window
from facefolds_core.geometry.sphere_uv import Window

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


@dataclass(frozen=True)
class Glossy:
    """A reflection and the windows (u0, u1, v0, v1) of the layers' texture coordinates."""

    maps: ReflectionMaps
    windows: Sequence[Window]

    @classmethod
    def of(cls, level: AssetLevel) -> Glossy | None:
        """That of a level of an asset; None where it has none."""
        maps = level.reflection()
        return None if maps is None else cls(maps, level.windows)

    def to_maps(self, layer: int) -> NDArray[np.float32]:
        """(4,) the uniform `to_maps` of a layer."""
        return np.array(window_to_window(self.windows[layer], self.maps.window), np.float32)

    def textures(self, context: moderngl.Context) -> list[tuple[str, moderngl.Texture]]:
        """Names of the samplers, and what they read."""
        maps = self.maps
        images = {
            "added": np.concatenate([maps.offset, maps.gloss[..., None]], -1),
            "normals": maps.normals,
            "environment": maps.environment,
        }
        return [(name, upload(context, image)) for name, image in images.items()]


def upload(context: moderngl.Context, image: NDArray[Any]) -> moderngl.Texture:
    """An image (H, W, C), uint8 or else as float32. Stored values as they are: no sRGB format. Row 0 is the top, as t
    runs."""
    height, width, channels = image.shape
    kind = "f1" if image.dtype == np.uint8 else "f4"
    data = np.ascontiguousarray(image, np.uint8 if kind == "f1" else np.float32).tobytes()
    texture = context.texture((width, height), channels, data, alignment=1, dtype=kind)
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    texture.repeat_x = texture.repeat_y = False
    return texture
