"""Blender add-on (5.0): its importer of glTF reads EXT_layered_volumetric_video (docs/reference/).

Install it in the preferences' add-ons ("Install from Disk"), then import a .glb as usual: the layers come in the place
of the still, with the video beside the file (face.glb -> face.glb.mp4) as a movie texture, and the scene has its rate
and length. Set the view transform to Raw, and in Cycles the transparent bounces to 8 a layer (`render.py` does both).
The reflection is passed over. Every crossing of a layer blends, backs are left out.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

bl_info = {
    "name": "EXT_layered_volumetric_video for glTF",
    "author": "facefolds",
    "version": (0, 2, 0),
    "blender": (5, 0, 0),
    "location": "File > Import > glTF 2.0",
    "description": "Imports layered volumetric video",
    "category": "Import-Export",
}
NAME, TEXTURE_VIDEO = "EXT_layered_volumetric_video", "KHR_texture_video"
COLOUR, ALPHA = "st", "st_alpha"
"""UV maps of places in the picture."""


def register() -> None:
    """The importer finds `glTF2ImportUserExtension` by itself."""


def unregister() -> None:
    """See `register`."""


class glTF2ImportUserExtension:  # noqa: N801 (the importer's name)
    """What Blender's importer calls."""

    def __init__(self) -> None:
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        self.extensions = [Extension(name=name, extension={}, required=True) for name in (NAME, TEXTURE_VIDEO)]
        self.rate = 0.0

    def gather_import_node_before_hook(self, vnode: Any, node: Any, gltf: Any) -> None:
        """The layers in the place of the still, each with a material of its own to be told by."""
        from io_scene_gltf2.io.com.gltf2_io import Material

        said = (node.extensions or {}).get(NAME) if node is not None else None
        if said is None:
            return
        node.mesh = said["mesh"]
        gltf.data.materials = gltf.data.materials or []
        for layer, primitive in enumerate(gltf.data.meshes[node.mesh].primitives):
            primitive.material = len(gltf.data.materials)
            material = Material.from_dict({"name": f"layer {layer}"})
            material.blender_material = {}
            gltf.data.materials.append(material)
        scene, (numerator, denominator) = bpy.context.scene, said["frameRate"]
        self.rate = numerator / denominator
        scene.render.fps = max(1, round(self.rate))
        scene.render.fps_base = self.rate / scene.render.fps  # the importer multiplies by it; set right below
        scene.frame_start, scene.frame_end = 0, said["frames"] - 1

    def gather_import_node_after_hook(self, vnode: Any, node: Any, thing: Any, gltf: Any) -> None:
        """The movie on the layers."""
        said = (node.extensions or {}).get(NAME) if node is not None else None
        if said is None:
            return
        movie = movie_of(gltf, said)
        thing["layers"], thing["video"] = len(said["rectangles"]), movie
        place_in_picture(thing.data, said)
        material = bpy.data.materials.new("layers")
        material.use_nodes = True
        blend_as_stored(material, [(COLOUR, movie), (ALPHA, movie)])
        for number, one in enumerate(list(thing.data.materials)):
            thing.data.materials[number] = material
            bpy.data.materials.remove(one)
        for texture in (one for one in material.node_tree.nodes if one.type == "TEX_IMAGE"):
            texture.image_user.frame_duration = said["frames"]
            texture.image_user.frame_start = 0
            texture.image_user.use_cyclic = texture.image_user.use_auto_refresh = True

    def gather_import_scene_after_animation_hook(self, gltf_scene: Any, scene: Any, gltf: Any) -> None:
        """Blender's own meaning of the base: frames a second are fps / fps_base."""
        if self.rate:
            render = bpy.context.scene.render
            render.fps_base = render.fps / self.rate


def place_in_picture(mesh: Any, said: dict[str, Any]) -> None:
    """UV maps of the layers' places among colours and alphas, v up, from those within each layer's own rectangle."""
    loops, faces = len(mesh.loops), len(mesh.polygons)
    uv = np.empty(2 * loops, np.float32)
    mesh.uv_layers[0].data.foreach_get("uv", uv)
    layer, corners = np.empty(faces, np.int32), np.empty(faces, np.int32)
    mesh.polygons.foreach_get("material_index", layer)
    mesh.polygons.foreach_get("loop_total", corners)
    rectangle = np.asarray(said["rectangles"], float)[np.repeat(layer, corners)]
    st = uv.reshape(-1, 2) * (1, -1) + (0, 1)
    mesh.uv_layers.remove(mesh.uv_layers[0])
    for name, part in ((COLOUR, "colorRectangle"), (ALPHA, "alphaRectangle")):
        at = (rectangle[:, :2] + st * rectangle[:, 2:] + said[part][:2]) / (said["width"], said["height"])
        made = mesh.uv_layers.new(name=name)
        made.data.foreach_set("uv", (at * (1, -1) + (0, 1)).astype(np.float32).ravel())


def movie_of(gltf: Any, said: dict[str, Any]) -> str:
    """The name of the image that plays the first video, which is written beside the file."""
    from io_scene_gltf2.io.imp.gltf2_io_binary import BinaryData

    source = gltf.data.textures[said["textures"][0]].extensions[TEXTURE_VIDEO]["source"]
    video = gltf.data.extensions[TEXTURE_VIDEO]["videos"][source]
    kind = "webm" if video["mimeType"].startswith("video/webm") else "mp4"
    path = Path(f"{gltf.filename}.{kind}")
    path.write_bytes(bytes(BinaryData.get_buffer_view(gltf, video["bufferView"])))
    name: str = bpy.data.images.load(str(path)).name
    return name


def blend_as_stored(material: Any, images: list[tuple[str, str]], shine: Any = None) -> None:
    """Unlit: emission of the texture's stored colour, mixed with transparency by its alpha.

    Of each layer only the nearest crossing counts, which a material cannot know. Back sides are left out instead: where
    a ray comes out through a fold of the sheet, they are what would count twice.

    Args:
        images: UV map and image's name of the colours and, where they have no alpha of their own, of the alphas.
        shine: (tree, socket of the colour) -> socket of the colour with a reflection.
    """
    tree = material.node_tree
    tree.nodes.clear()
    nodes = [texture_node(tree, *one) for one in images]
    colour = nodes[0].outputs["Color"]
    if shine is not None:
        colour = shine(tree, colour)
    alpha = nodes[0].outputs["Alpha"] if len(nodes) == 1 else nodes[1].outputs["Color"]  # grey
    emission, clear = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeBsdfTransparent")
    mix, out = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(colour, emission.inputs["Color"])
    geometry, front = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMath")
    front.operation = "SUBTRACT"
    front.use_clamp = True
    tree.links.new(alpha, front.inputs[0])
    tree.links.new(geometry.outputs["Backfacing"], front.inputs[1])
    tree.links.new(front.outputs[0], mix.inputs[0])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(emission.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], out.inputs["Surface"])
    material.cycles.emission_sampling = "NONE"  # nothing else is lit
    material.use_backface_culling = False
    material.surface_render_method = "BLENDED"


def texture_node(tree: Any, uv_map: str, name: str) -> Any:
    """A look-up of stored values."""
    image = bpy.data.images[name]
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"  # colour and alpha are interpolated each by itself
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.extension, texture.interpolation = image, "EXTEND", "Linear"
    if uv_map:
        place = tree.nodes.new("ShaderNodeUVMap")
        place.uv_map = uv_map
        tree.links.new(place.outputs["UV"], texture.inputs["Vector"])
    return texture
