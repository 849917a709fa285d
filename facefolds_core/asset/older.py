"""Manifests of older format versions, brought into the form of this one when they are read.

Version 3 has the poses of a head that moves in the manifest, which is read as it stands.

Version 1 (facefolds 0.1): one level without a name, one video, no MIME type, no sound, no pictures. Version 2: a file a
mesh, frames a second as a decimal number; early ones had `view_effects` in each level, null or a picture with a place
in it for each layer, which a player was always free to ignore: it is left out.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

OLDEST = 1
MOST_RATE = 1001
"""Largest denominator of a rate that was written as a decimal number: that of 30000/1001."""


def brought_up(value: dict[str, Any]) -> dict[str, Any]:
    """The JSON of a manifest of an older version as this one would say it; what makes no sense is left as it is."""
    if value["version"] == 3:
        return value | {"version": 4}
    try:
        return _from_2(_from_1(value) if value["version"] == 1 else value)
    except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError):
        return value | {"version": 4, "minVersion": 3}  # the models say what is wrong


def _from_1(value: dict[str, Any]) -> dict[str, Any]:
    rest = dict(value)
    layers, texture = rest.pop("layers"), dict(rest.pop("texture"))
    texture.pop("layer_resolution", None)
    video = {key: texture.pop(key) for key in ("bytes", "sha256", "codec", "level", "pixel_format")}
    video |= {"file": texture.pop("video"), "container": "mp4", "mime": "video/mp4"}
    level = {
        "name": "full",
        "layers": layers,
        "texture": texture | {"videos": [video]},
        "quality": None,
        "bytes": video["bytes"] + sum(layer["bytes"] for layer in layers),
    }
    return rest | {"levels": [level], "audio": None, "poster": None, "photos": []}


def _from_2(value: dict[str, Any]) -> dict[str, Any]:
    levels = [_level(level) for level in value["levels"]]
    return value | {"version": 4, "minVersion": 3, "levels": levels}


def _level(level: dict[str, Any]) -> dict[str, Any]:
    texture = dict(level["texture"])
    fps = texture.pop("fps")
    if isinstance(fps, bool) or not isinstance(fps, int | float):
        raise TypeError("no number")
    rate = Fraction(fps).limit_denominator(MOST_RATE)
    texture |= {"frame_rate": [rate.numerator, rate.denominator], "keyframes": [0]}
    meshes = [{"file": layer["mesh"], "bytes": layer["bytes"], "sha256": layer["sha256"]} for layer in level["layers"]]
    layers = [layer | {"offset": 0} for layer in level["layers"]]
    kept = {key: part for key, part in level.items() if key != "view_effects"}
    if level.get("view_effects") is not None:
        kept["bytes"] -= level["view_effects"]["bytes"]
        layers = [{key: part for key, part in layer.items() if key != "effects_rect"} for layer in layers]
    return kept | {"texture": texture, "meshes": meshes, "layers": layers}
