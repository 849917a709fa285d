"""Renders an asset's GLB or USD in Blender (5.0; Cycles, on the processor), its layers blended as the format asks.

    blender -b -P engines/blender/render.py -- data/actor/asset.glb --out face.png --azimuth 25
    .venv-blender/bin/python engines/blender/render.py data/actor/asset.glb --out face.png      # bpy from pip

Blender's importers turn y up into z up, so that the subject looks to -y and its left is +x. What it makes of
the materials shows the layers, but in linear light and through its view transform. `prepare` sets them right: the
textures' stored values go through unchanged, are blended as they are and written as they are (view transform Raw).

Needs nothing of the project: Blender's Python has other versions of what the project needs.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).parent))  # Blender runs the script without its folder
from layered_volumetric_video import blend_as_stored
from reflection import read_gloss, reflected

ASSET_TO_BLENDER = Matrix(((0, 1, 0), (-1, 0, 0), (0, 0, 1)))
"""Of the asset's points (x forward, y to the subject's left, z up), after the GLB's root node and the importer."""
FLIP = Matrix(((1, 0, 0), (0, -1, 0), (0, 0, -1)))
"""A camera's own axes, OpenCV's -> Blender's."""
SENSOR = 36.0
"""Millimetres; only its ratio to the focal length counts."""
CROSSINGS = 8
"""Of one layer by one ray at most, for the number of transparent bounces."""


def prepare(
    file: Path, background: tuple[float, float, float], samples: int, asset: Path | None = None, frame: int = 0
) -> None:
    """An empty scene with the asset's layers as they are to be blended.

    Args:
        file: what `facefolds export gltf`, `glb` or `usd` wrote; of USD, the first frame is shown.
        background: stored (sRGB) values in [0, 1]; behind the layers.
        samples: x samples a pixel; with 1, a pixel is what the ray through its centre sees.
        asset: the folder of the asset that a GLB was made of, for its reflection; None leaves it out.
        frame: of a GLB with a video.
    """
    import addon_utils  # is there once bpy is

    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("layered_volumetric_video", default_set=True)
    if file.suffix.startswith(".usd"):
        bpy.ops.wm.usd_import(filepath=str(file.resolve()))
    else:
        bpy.ops.import_scene.gltf(filepath=str(file))
    meshes = [thing for thing in bpy.data.objects if thing.type == "MESH"]
    gloss = None if asset is None else read_gloss(asset)
    shine = None if gloss is None else lambda tree, colour: reflected(tree, colour, gloss)
    for mesh in meshes:
        drop_core(mesh.data)
        for slot in () if "video" in mesh else mesh.material_slots:
            blend_as_stored(slot.material, sorted(images_of(slot.material.node_tree)), shine)
    layers = sum(mesh.get("layers", 1) for mesh in meshes)  # a GLB has them in one mesh
    scene = bpy.context.scene
    scene.frame_set(frame)
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples * samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 0.01 if samples == 1 else 1.0
    scene.cycles.transparent_max_bounces = CROSSINGS * layers
    scene.cycles.min_transparent_bounces = CROSSINGS * layers  # fewer: rays end by chance, the picture is noisy
    scene.display_settings.display_device = "sRGB"
    scene.view_settings.view_transform = "Raw"
    scene.view_settings.look = "None"
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.dither_intensity = 0.0
    scene.render.resolution_percentage = 100
    scene.world = bpy.data.worlds.new("background")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*background, 1.0)


def drop_core(mesh: Any) -> None:
    """Leave out the opaque core of a GLB, which is for programs that do not trace rays through what is transparent."""
    core = [index for index, material in enumerate(mesh.materials) if material.name.startswith("core")]
    if not core:
        return
    import bmesh  # is there once bpy is

    parts = bmesh.new()
    parts.from_mesh(mesh)
    bmesh.ops.delete(parts, geom=[face for face in parts.faces if face.material_index in core], context="FACES")
    parts.to_mesh(mesh)
    parts.free()


def images_of(tree: Any) -> list[tuple[str, str]]:
    """The UV map and the image of each texture: one with alpha of its own in a GLB; in USD "st" and "st_alpha"."""
    found = []
    for node in (node for node in tree.nodes if node.type == "TEX_IMAGE"):
        places = [link.from_node for link in tree.links if link.to_node == node]
        found.append((next((one.uv_map for one in places if one.type == "UVMAP"), ""), node.image.name))
    return found


def render(view: dict[str, Any]) -> None:
    """One picture.

    Args:
        view: file, width, height, K (3, 3) and w2c (3, 4) as in docs/reference/conventions.md; pixels are square.
    """
    scene, width, height, K = bpy.context.scene, view["width"], view["height"], view["K"]
    rotation = Matrix([row[:3] for row in view["w2c"]])
    centre = -(rotation.transposed() @ Vector([row[3] for row in view["w2c"]]))
    data = bpy.data.cameras.new("camera")
    camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(camera)
    camera.matrix_world = Matrix.LocRotScale(
        ASSET_TO_BLENDER @ centre, ASSET_TO_BLENDER @ rotation.transposed() @ FLIP, None
    )
    longer = max(width, height)
    data.sensor_fit, data.sensor_width = "AUTO", SENSOR
    data.lens = K[0][0] * SENSOR / longer
    data.shift_x, data.shift_y = (width / 2 - K[0][2]) / longer, (K[1][2] - height / 2) / longer
    data.clip_start, data.clip_end = 0.01, 100.0
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.filepath = str(view["file"])
    bpy.ops.render.render(write_still=True)
    bpy.data.objects.remove(camera)


def orbit(
    azimuth: float, elevation: float, distance: float, size: tuple[int, int], field_of_view: float
) -> dict[str, Any]:
    """An upright camera at the subject: azimuth to its left and elevation in degrees, as of `facefolds render`."""
    a, e = math.radians(azimuth), math.radians(elevation)
    outward = Vector((math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)))
    right = (-outward).cross(Vector((0, 0, 1))).normalized()
    rotation = Matrix((right, (-outward).cross(right), -outward))
    focal = min(size) / (2 * math.tan(math.radians(field_of_view) / 2))
    shift = -(rotation @ (distance * outward))
    return {
        "width": size[0],
        "height": size[1],
        "K": [[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1]],
        "w2c": [[*row, shift[i]] for i, row in enumerate(rotation)],
    }


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="render.py", description="Render an asset's GLB or USD in Blender.")
    parser.add_argument("file", type=Path, metavar="FILE", help=".glb, .usdc or .usdz")
    parser.add_argument("--out", type=Path, help="PNG to write")
    parser.add_argument("--size", default="640x640", help="WIDTHxHEIGHT in pixels")
    parser.add_argument("--azimuth", type=float, default=0.0, help="degrees to the subject's left")
    parser.add_argument("--elevation", type=float, default=0.0, help="degrees upwards")
    parser.add_argument("--distance", type=float, default=1.0)
    parser.add_argument("--field-of-view", type=float, default=30.0, help="degrees, of the shorter side")
    parser.add_argument("--background", type=float, nargs=3, default=(0.086, 0.094, 0.114), help="RGB in 0..1")
    parser.add_argument("--samples", type=int, default=2, help="anti-aliasing: samples x samples a pixel")
    parser.add_argument("--reflection", type=Path, metavar="ASSET", help="folder of the asset that a GLB was made of")
    parser.add_argument("--frame", type=int, default=0, help="of a .glb with a video (`facefolds export gltf`)")
    parser.add_argument("--views", type=Path, help="JSON list of cameras with their files, instead of --out")
    given = parser.parse_args(arguments)
    if not given.file.is_file():
        parser.error(f"no such file: {given.file}")
    if (given.out is None) == (given.views is None):
        parser.error("give --out, or --views")
    if given.views:
        views = json.loads(given.views.read_text())
    else:
        width, height = (int(part) for part in given.size.split("x"))
        view = orbit(given.azimuth, given.elevation, given.distance, (width, height), given.field_of_view)
        views = [view | {"file": str(given.out.resolve())}]
    if given.reflection and (given.file.suffix != ".glb" or not (given.reflection / "manifest.json").is_file()):
        parser.error("--reflection goes with a .glb, and names the folder with manifest.json")
    prepare(given.file, tuple(given.background), given.samples, given.reflection, given.frame)
    for view in views:
        render(view)


if __name__ == "__main__":
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    main(own)
