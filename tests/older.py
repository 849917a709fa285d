"""Assets as older versions of facefolds wrote them, which the web player still plays, made from today's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.hostile.fuzz_assets import seal

Value = dict[str, Any]

NEWER = ("minVersion", "bounds", "extensionsUsed", "extras", "track_file")


def as_version_2(value: Value) -> Value:
    """The manifest with a file `LEVEL_00.drc`, ... for each mesh and a decimal rate; other values are the same."""
    old = {key: part for key, part in value.items() if key not in NEWER} | {"version": 2, "levels": []}
    for level in value["levels"]:
        texture = dict(level["texture"])
        numerator, denominator = texture.pop("frame_rate")
        texture.pop("keyframes")
        texture["fps"] = numerator / denominator
        layers = [dict(layer) | {"mesh": f"{level['name']}_{i:02d}.drc"} for i, layer in enumerate(level["layers"])]
        for layer in layers:
            layer.pop("offset")
        kept = {key: part for key, part in level.items() if key != "meshes"}
        old["levels"].append(kept | {"texture": texture, "layers": layers})
    return old


def as_version_1(value: Value) -> Value:
    """Of one level with one video, as facefolds 0.1 wrote it."""
    old = as_version_2(value) | {"version": 1}
    (level,) = old.pop("levels")
    texture = dict(level["texture"])
    (video,) = texture.pop("videos")
    texture |= {key: part for key, part in video.items() if key not in ("file", "container", "mime")}
    texture |= {"video": video["file"], "layer_resolution": 64}
    for key in ("audio", "poster", "photos"):
        old.pop(key)
    return old | {"layers": level["layers"], "texture": texture}


def make_older(folder: Path, version: int) -> Path:
    """Rewrite an asset on disk: manifest and meshes; returns the folder."""
    value = json.loads((folder / "manifest.json").read_text())
    for level in value["levels"]:
        data = (folder / level["meshes"][0]["file"]).read_bytes()
        for index, layer in enumerate(level["layers"]):
            part = data[layer["offset"] : layer["offset"] + layer["bytes"]]
            (folder / f"{level['name']}_{index:02d}.drc").write_bytes(part)
        (folder / level["meshes"][0]["file"]).unlink()
    seal(folder, {1: as_version_1, 2: as_version_2}[version](value))
    return folder
