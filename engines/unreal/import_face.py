"""Brings a face into Unreal Engine 5 as meshes, an image sequence and two materials. NEVER RUN: Unreal is not at hand.

    facefolds export gltf data/actor/asset face.glb       # its still gives the meshes
    facefolds export usd data/actor/asset face_usd        # its textures/ are the image sequence
    py import_face.py C:/face.glb C:/face_usd/textures    # in Unreal's console, with the plugins Python and Img Media

Every name in it is one of the Python API of 5.6 (unreal-stub 0.3 has them all); only a mock has taken it. It makes
/Game/facefolds: the meshes, `M_core` (masked) and `M_shell` (translucent), both unlit, and a media player that loops.
Then place the meshes and open the source in the player. Colours go through linear light and tone mapping; backs are
left out; the head's motion and the reflection are not brought along.
"""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import unreal

NAME = "EXT_layered_volumetric_video"
PLACE = "/Game/facefolds"
CUTOFF = 0.9


def said_of(glb: Path) -> dict[str, Any]:
    """What the extension says in the file."""
    data = glb.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    found = [node["extensions"][NAME] for node in json.loads(data[20 : 20 + size])["nodes"] if "extensions" in node]
    return dict(found[0])


def window(said: dict[str, Any], part: str) -> tuple[float, float, float, float]:
    """(scale u, scale v, offset u, offset v): from places in the colour image to those in the whole picture."""
    x, y, w, h = said[part]
    return w / said["width"], h / said["height"], x / said["width"], y / said["height"]


def made(name: str, kind: Any, factory: Any) -> Any:
    """A new asset in our folder."""
    return unreal.AssetToolsHelpers.get_asset_tools().create_asset(name, PLACE, kind, factory)


def media_of(folder: Path, rate: list[int]) -> Any:
    """The media texture that shows the image sequence."""
    source = made("sequence", unreal.ImgMediaSource, unreal.ImgMediaSourceFactoryNew())
    source.set_sequence_path(str(min(folder.iterdir())))
    source.set_editor_property("frame_rate_override", unreal.FrameRate(*rate))
    player = made("player", unreal.MediaPlayer, unreal.MediaPlayerFactoryNew())
    player.set_looping(True)
    texture = made("picture", unreal.MediaTexture, unreal.MediaTextureFactoryNew())
    texture.set_media_player(player)
    return texture


def material_of(name: str, blending: Any, opacity: Any, texture: Any, said: dict[str, Any]) -> Any:
    """Unlit: the picture's colour as emission, its lower half as opacity."""
    edit = unreal.MaterialEditingLibrary
    material = made(name, unreal.Material, unreal.MaterialFactoryNew())
    material.set_editor_property("shading_model", unreal.MaterialShadingModel.MSM_UNLIT)
    material.set_editor_property("blend_mode", blending)
    material.set_editor_property("opacity_mask_clip_value", CUTOFF)
    for part, output, wanted in (
        ("colorRectangle", "RGB", unreal.MaterialProperty.MP_EMISSIVE_COLOR),
        ("alphaRectangle", "R", opacity),
    ):
        *scale, left, top = window(said, part)
        place = edit.create_material_expression(material, unreal.MaterialExpressionTextureCoordinate, -900, 0)
        place.set_editor_property("u_tiling", scale[0])
        place.set_editor_property("v_tiling", scale[1])
        offset = edit.create_material_expression(material, unreal.MaterialExpressionConstant2Vector, -900, 200)
        offset.set_editor_property("r", left)
        offset.set_editor_property("g", top)
        there = edit.create_material_expression(material, unreal.MaterialExpressionAdd, -700, 0)
        edit.connect_material_expressions(place, "", there, "A")
        edit.connect_material_expressions(offset, "", there, "B")
        look = edit.create_material_expression(material, unreal.MaterialExpressionTextureSampleParameter2D, -500, 0)
        look.set_editor_property("parameter_name", part)
        look.set_editor_property("texture", texture)
        look.set_editor_property("sampler_type", unreal.MaterialSamplerType.SAMPLERTYPE_EXTERNAL)
        edit.connect_material_expressions(there, "", look, "UVs")
        edit.connect_material_property(look, output, wanted)
    edit.recompile_material(material)
    return material


def imported(glb: Path) -> list[Any]:
    """The static meshes of the file."""
    task = unreal.AssetImportTask()
    for name, value in (
        ("filename", str(glb)),
        ("destination_path", PLACE),
        ("automated", True),
        ("replace_existing", True),
        ("save", True),
    ):
        task.set_editor_property(name, value)
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    assets = [unreal.load_asset(path) for path in task.get_editor_property("imported_object_paths")]
    return [asset for asset in assets if isinstance(asset, unreal.StaticMesh)]


def main(glb: Path, pictures: Path) -> None:
    said = said_of(glb)
    texture = media_of(pictures, said["frameRate"])
    blend, targets = unreal.BlendMode, unreal.MaterialProperty
    core = material_of("M_core", blend.BLEND_MASKED, targets.MP_OPACITY_MASK, texture, said)
    shell = material_of("M_shell", blend.BLEND_TRANSLUCENT, targets.MP_OPACITY, texture, said)
    for mesh in imported(glb):
        for slot, one in enumerate(mesh.get_editor_property("static_materials")):
            name = str(one.get_editor_property("imported_material_slot_name"))
            mesh.set_material(slot, core if "core" in name else shell)
    unreal.EditorAssetLibrary.save_directory(PLACE)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
