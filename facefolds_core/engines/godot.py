"""Plain meshes and a picture a frame (a folder), for the add-on for Godot 3 in engines/godot (docs/guide/engines.md).

Godot 3 has no Draco (it loads garbage without an error), no MP4, and its player of WebM cannot seek. So the folder
holds plain binary meshes with y up, and every frame as a picture of its own.

`facefolds.json` names all files; rectangles are the asset's own ([x, y, width, height], pixels of the picture, y down).
`track` (absent where the head stands still) has a pose a frame, in the asset's own axes, and `torso` is what stays
meanwhile, as the manifest has them.
A mesh file is little-endian: 3 V float32 positions, 2 V float32 texture coordinates (s, t), 3 T uint32 indices.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from PIL import Image

from facefolds_core.asset.manifest_extras import StandingTorso
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.asset.stored import refuse_changed
from facefolds_core.engines._folder import in_words, refuse_other_content, rgb_picture
from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.reflections import window_to_window

CONTENTS = "facefolds.json"
FORMAT, VERSION = "facefolds-godot", 1
PICTURE = "frame_{:05d}.webp"
_OF_A_REFLECTION = {"file", "width", "height", "environment_rect", "gloss_rect", "offset_rect", "normals_rect"}
QUALITY = 95
"""Of the pictures: lossy WebP, 0..100. Lossless ones would be several times larger."""


def export(out: Path, level: AssetLevel, subject: str) -> str:
    """Write a level for Godot into a folder, which is replaced.

    Raises:
        UserError: if the folder holds anything else than an earlier export, or the asset's video is damaged.
    """
    refuse_other_content(out, CONTENTS)
    texture = level.entry.texture
    with atomic_folder(out) as folder:
        layers: list[dict[str, Any]] = []
        for index, (mesh, entry) in enumerate(zip(level.layers, level.entry.layers, strict=True)):
            name = f"layer_{index:02d}.mesh"
            (folder / name).write_bytes(mesh_bytes(mesh))
            counts = {"vertices": len(mesh.vertices), "triangles": len(mesh.faces)}
            layers.append({"mesh": name, **counts, "texture_rect": list(entry.texture_rect)})
        for number, picture in enumerate(level.pictures()):
            Image.fromarray(rgb_picture(picture, texture)).save(
                folder / PICTURE.format(number), quality=QUALITY, method=4
            )
        contents: dict[str, Any] = {
            "format": FORMAT,
            "version": VERSION,
            "subject": subject,
            "frames": texture.frames,
            "fps": texture.fps,
            "width": texture.width,
            "height": texture.height,
            "colour_rect": list(texture.colour_rect),
            "alpha_rect": list(texture.alpha_rect),
            "pictures": [PICTURE.format(number) for number in range(texture.frames)],
            "layers": layers,
        }
        one = level.entry.reflection
        if one is not None:
            refuse_changed(level.folder, one)
            shutil.copyfile(level.folder / one.file, folder / one.file)
            scales = [one.environment_scale, one.gloss_scale, one.offset_scale]
            contents["reflection"] = {**one.model_dump(mode="json", include=_OF_A_REFLECTION), "scales": scales}
            for layer, window in zip(layers, level.windows, strict=True):
                layer["to_maps"] = list(window_to_window(window, one.uv_window))
        if level.track is not None:
            poses = zip(level.track.quaternions.tolist(), level.track.translations.tolist(), strict=True)
            contents["track"] = [{"quaternion": q, "translation": t} for q, t in poses]
            if level.track.torso is not None:
                contents["torso"] = StandingTorso.of(level.track.torso).model_dump(mode="json")
        write_json(folder / CONTENTS, contents)
        return in_words(level, folder)


def mesh_bytes(mesh: TexturedMesh) -> bytes:
    """A layer as the add-on reads it, in Godot's axes: y up, the subject looks to +z, its left is +x."""
    vertices = mesh.vertices[:, [1, 2, 0]].astype("<f4").tobytes()
    return vertices + mesh.st.astype("<f4").tobytes() + mesh.faces.astype("<u4").tobytes()
