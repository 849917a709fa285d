"""Say what is wrong with a GLB that has EXT_layered_volumetric_video: every problem in words, with its place.

What core glTF asks for beyond it is Khronos' validator's to say.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError

from facefolds_core.asset.audio import sound_problem
from facefolds_core.asset.checks import FPS_RANGE, MOST_FRAMES
from facefolds_core.asset.draco import DracoError, decode_mesh
from facefolds_core.asset.gltf.document import Glb, GlbError, Loose, Primitive, in_words, validated
from facefolds_core.asset.gltf.extension import DRACO, NAME, TEXTURE_VIDEO, Index, LayeredVideo, Reflection
from facefolds_core.asset.manifest_base import FARTHEST
from facefolds_core.asset.packing import AtlasLayout, inside
from facefolds_core.asset.video import BT709_LIMITED, decode_video, probe_video
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.track import UNIT

EDGE = 1e-6
"""How far beyond [0, 1] texture coordinates may be."""
LENGTH = 1e-4
"""How far from 1 the length of a torso's normal or quaternion may be."""
INSTANT = 1e-3
"""Of a frame's time: how far a key of the animation may be from its picture."""


class Video(Loose):
    """An entry of `videos` of KHR_texture_video."""

    buffer_view: Index
    mime_type: str


class Videos(Loose):
    """KHR_texture_video of the file."""

    videos: Annotated[tuple[Video, ...], Field(min_length=1)]


class Source(Loose):
    """KHR_texture_video of a texture."""

    source: Index


def check_glb(path: Path) -> list[str]:
    """Check a file; whether it is glTF otherwise is not looked at.

    Returns:
        problems in words, each beginning with its place; empty if all is sound.

    Raises:
        OSError: if the file cannot be read.
    """
    try:
        glb = Glb(path.read_bytes())
    except GlbError as problem:
        return [str(problem)]
    except ValidationError as error:
        return in_words(error)
    nodes = [index for index, node in enumerate(glb.gltf.nodes) if NAME in node.extensions]
    if not nodes:
        return [f"/nodes: none has {NAME}"]
    problems = [
        f"/extensionsUsed: {name} is missing" for name in (NAME, TEXTURE_VIDEO) if name not in glb.gltf.extensions_used
    ]
    for index in nodes:
        problems += _node_problems(glb, index)
    return problems


def _node_problems(glb: Glb, index: int) -> list[str]:
    place = f"/nodes/{index}/extensions/{NAME}"
    node = glb.gltf.nodes[index]
    try:
        said = validated(LayeredVideo, node.extensions[NAME])
    except ValidationError as error:
        return in_words(error, place)
    problems = []
    if node.mesh is None and NAME not in glb.gltf.extensions_required:
        problems.append(f"/nodes/{index}: no mesh for viewers without the extension, which is not required")
    if len({round(abs(part), 6) for part in node.scale}) != 1:
        problems.append(f"/nodes/{index}/scale: uneven")
    for check in (
        _checksum_problems,
        _layout_problems,
        _layer_problems,
        _motion_problems,
        _torso_problems,
        _reflection_problems,
        _video_problems,
    ):
        try:
            problems += check(glb, said, place, index)
        except GlbError as problem:
            problems.append(str(problem))
    return problems


def _checksum_problems(glb: Glb, said: LayeredVideo, place: str, _: int) -> Iterator[str]:
    """Bytes that are not those that were written."""
    for number, one in enumerate(said.checksums or ()):
        if sha256(glb.view(one.buffer_view, f"{place}/checksums/{number}/bufferView")).hexdigest() != one.sha256:
            yield f"/bufferViews/{one.buffer_view}: damaged: another SHA-256 than {place}/checksums/{number} says"


def _layout_problems(glb: Glb, said: LayeredVideo, place: str, _: int) -> Iterator[str]:
    """Sizes, places, rates."""
    layout = AtlasLayout(said.width, said.height, said.color_rectangle, said.alpha_rectangle, said.rectangles)
    for problem in layout.problems():
        for ours, theirs in (
            ("colour_rect", "colorRectangle"),
            ("alpha_rect", "alphaRectangle"),
            ("texture_rect", "rectangle"),
        ):
            problem = problem.replace(ours, theirs)
        yield f"{place}: {problem}"
    low, high = FPS_RANGE
    if not low <= said.rate <= high:
        yield f"{place}/frameRate: {float(said.rate):g} a second, not within {low:g} and {high:g}"
    if said.frames > MOST_FRAMES:
        yield f"{place}/frames: more than {MOST_FRAMES}"
    if said.still_frame >= said.frames:
        yield f"{place}/stillFrame: frame {said.still_frame} of {said.frames}"


def _layer_problems(glb: Glb, said: LayeredVideo, place: str, _: int) -> Iterator[str]:
    """The meshes."""
    primitives = glb.gltf.at("meshes", said.mesh, f"{place}/mesh").primitives
    for index, node in enumerate(glb.gltf.nodes):
        if node.mesh == said.mesh:
            yield f"/nodes/{index}/mesh: it would show the layers as they are"
    if len(primitives) != len(said.rectangles):
        yield f"{place}/rectangles: {len(said.rectangles)} for {len(primitives)} primitives of meshes[{said.mesh}]"
    for number, primitive in enumerate(primitives):
        here = f"/meshes/{said.mesh}/primitives/{number}"
        try:
            mesh = layer_mesh(glb, primitive, here)
        except GlbError as problem:
            yield str(problem)
            continue
        if not np.isfinite(mesh.vertices).all() or np.abs(mesh.vertices).max() > FARTHEST:
            yield f"{here}/attributes/POSITION: not finite, or more than {FARTHEST:g} units away"
        if not ((mesh.st >= -EDGE) & (mesh.st <= 1 + EDGE)).all():
            yield f"{here}/attributes/TEXCOORD_0: outside [0, 1]"


def layer_mesh(glb: Glb, primitive: Primitive, place: str) -> TexturedMesh:
    """A layer's triangles, plain or by Draco.

    Raises:
        GlbError: if they cannot be read.
    """
    if primitive.mode != 4:
        raise GlbError(f"{place}/mode", f"{primitive.mode}, triangles (4) are needed")
    missing = [name for name in ("POSITION", "TEXCOORD_0") if name not in primitive.attributes]
    if missing or primitive.indices is None:
        raise GlbError(place, f"it lacks {', '.join(missing) or 'indices'}")
    if DRACO in primitive.extensions:
        return _draco_mesh(glb, primitive, place)
    position, st = (primitive.attributes[name] for name in ("POSITION", "TEXCOORD_0"))
    vertices = glb.numbers(position, f"{place}/attributes/POSITION", "VEC3")
    places = glb.numbers(st, f"{place}/attributes/TEXCOORD_0", "VEC2")
    indices = glb.numbers(primitive.indices, f"{place}/indices", "SCALAR")
    if vertices.dtype.kind != "f" or indices.dtype.kind != "u" or len(vertices) != len(places) or len(indices) % 3:
        raise GlbError(place, "positions that are no floats, or counts that do not fit")
    if places.dtype.kind == "u":
        places = places / np.float32(np.iinfo(places.dtype).max)
    if indices.max() >= len(vertices):
        raise GlbError(f"{place}/indices", f"vertex {indices.max()} of {len(vertices)}")
    return TexturedMesh(vertices, indices.reshape(-1, 3).astype(np.int32), places.astype(np.float32))


def _draco_mesh(glb: Glb, primitive: Primitive, place: str) -> TexturedMesh:
    here = f"{place}/extensions/{DRACO}"
    said = primitive.extensions[DRACO]
    view = said.get("bufferView") if isinstance(said, dict) else None
    if not isinstance(view, int) or isinstance(view, bool) or view < 0:
        raise GlbError(here, "no bufferView")
    try:
        mesh = decode_mesh(glb.view(view, f"{here}/bufferView"))
    except DracoError as error:
        raise GlbError(f"/bufferViews/{view}", f"no mesh of Draco: {error}") from None
    counts = {"POSITION": len(mesh.vertices), "TEXCOORD_0": len(mesh.vertices), "indices": mesh.faces.size}
    for name, count in counts.items():
        index = primitive.indices if name == "indices" else primitive.attributes[name]
        assert index is not None
        accessor = glb.gltf.at("accessors", index, f"{place}/{name}")
        if accessor.count != count:
            raise GlbError(f"/accessors/{index}/count", f"{accessor.count}, {count} are decoded")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise GlbError(f"/bufferViews/{view}", "triangles of vertices that are not there")
    return mesh


def _motion_problems(glb: Glb, said: LayeredVideo, place: str, node: int) -> Iterator[str]:
    """The animation that moves the node."""
    if said.animation is None:
        return
    animation = glb.gltf.at("animations", said.animation, f"{place}/animation")
    times = np.arange(said.frames) / float(said.rate) if said.frames <= MOST_FRAMES else np.zeros(0)
    paths = []
    for number, channel in enumerate(animation.channels):
        here = f"/animations/{said.animation}"
        paths.append(channel.target.path)
        if channel.target.node != node or channel.target.path not in ("rotation", "translation"):
            yield f"{here}/channels/{number}/target: not this node's rotation or translation"
            continue
        if channel.sampler >= len(animation.samplers):
            yield f"{here}/channels/{number}/sampler: there is no such sampler"
            continue
        sampler, at = animation.samplers[channel.sampler], f"{here}/samplers/{channel.sampler}"
        keys = glb.numbers(sampler.input, f"{at}/input", "SCALAR")
        values = glb.numbers(sampler.output, f"{at}/output", "VEC4" if channel.target.path == "rotation" else "VEC3")
        if sampler.interpolation != "LINEAR" or keys.dtype.kind != "f" or values.dtype.kind != "f":
            yield f"{at}: not LINEAR, or not of floats"
        elif keys.shape != times.shape or not np.abs(keys - times).max() <= INSTANT / said.rate:
            yield f"{at}/input: not the times of {said.frames} pictures"
        elif len(values) != len(keys) or not np.abs(values).max() <= FARTHEST:
            yield f"{at}/output: another number of poses, or some that are not finite"
        elif values.shape[1] == 4 and not np.abs(np.linalg.norm(values, axis=1) - 1).max() <= UNIT:
            yield f"{at}/output: quaternions that are not of unit length"
    if len(set(paths)) != len(paths) or not paths:
        yield f"/animations/{said.animation}/channels: none, or two for one path"


def _torso_problems(glb: Glb, said: LayeredVideo, place: str, node: int) -> Iterator[str]:
    """What stays while the node moves."""
    one = said.torso
    if one is None:
        return
    if said.animation is None:
        yield f"{place}/torso: there is no animation over which it would stay"
    if any(abs(part - 1) > EDGE for part in glb.gltf.nodes[node].scale):
        yield f"/nodes/{node}/scale: none is taken with a torso"
    if not np.abs([one.offset, *one.translation]).max() <= FARTHEST:
        yield f"{place}/torso: more than {FARTHEST:g} units away"
    for name, values in (("normal", one.normal), ("rotation", one.rotation)):
        if not abs(np.linalg.norm(values) - 1) <= LENGTH:
            yield f"{place}/torso/{name}: not of unit length"


def _reflection_problems(glb: Glb, said: LayeredVideo, place: str, _: int) -> Iterator[str]:
    """The reflection's picture and rectangles."""
    one: Reflection | None = said.reflection
    if one is None:
        return
    here = f"{place}/reflection"
    if len(one.transforms) != len(said.rectangles):
        yield f"{here}/transforms: {len(one.transforms)} for {len(said.rectangles)} layers"
    texture = glb.gltf.at("textures", one.texture, f"{here}/texture")
    if texture.source is None:
        raise GlbError(f"/textures/{one.texture}", "no source")
    image = glb.gltf.at("images", texture.source, f"/textures/{one.texture}/source")
    if image.buffer_view is None:
        raise GlbError(f"/images/{texture.source}", "it is not in this file")
    try:
        size = open_picture(glb.view(image.buffer_view, f"/images/{texture.source}/bufferView")).size
    except DamagedPictureError as error:
        raise GlbError(f"/images/{texture.source}", f"a damaged picture: {error}") from None
    for name, rectangle in one.rectangles().items():
        if not inside(rectangle, size):
            yield f"{here}/{name}: {list(rectangle)} is not inside {size[0]} x {size[1]} pixels"


def _video_problems(glb: Glb, said: LayeredVideo, place: str, _: int) -> Iterator[str]:
    """Every picture of every video."""
    held = glb.gltf.extensions.get(TEXTURE_VIDEO)
    try:
        videos = validated(Videos, held).videos
    except ValidationError as error:
        yield from in_words(error, f"/extensions/{TEXTURE_VIDEO}")
        return
    for number, index in enumerate(said.textures):
        texture = glb.gltf.at("textures", index, f"{place}/textures/{number}")
        here = f"/textures/{index}/extensions/{TEXTURE_VIDEO}"
        try:
            source = validated(Source, texture.extensions.get(TEXTURE_VIDEO)).source
        except ValidationError as error:
            yield from in_words(error, here)
            continue
        if source >= len(videos):
            yield f"{here}/source: there is no video {source}: there are {len(videos)}"
            continue
        at = f"/extensions/{TEXTURE_VIDEO}/videos/{source}"
        if not videos[source].mime_type.startswith(("video/mp4", "video/webm")):
            yield f"{at}/mimeType: neither video/mp4 nor video/webm"
        data = glb.view(videos[source].buffer_view, f"{at}/bufferView")
        if said.frames <= min(MOST_FRAMES, len(data)):
            yield from (f"{at}: {problem}" for problem in _picture_problems(data, videos[source].mime_type, said))
        else:
            yield f"{at}: {said.frames} frames in {len(data)} bytes"


def _picture_problems(data: bytes, mime: str, said: LayeredVideo) -> Iterator[str]:
    count, size = 0, (said.width, said.height)
    try:
        with tempfile.NamedTemporaryFile() as file:
            file.write(data)
            file.flush()
            facts = probe_video(Path(file.name), io.BytesIO(data), said.rate, said.frames)
            if facts.pixel_format != "yuv420p" or facts.tags != BT709_LIMITED:
                yield f"{facts.pixel_format}, matrix and range {facts.tags}: 4:2:0, BT.709, limited range are needed"
            if "mp4a" in mime and (problem := sound_problem(Path(file.name), said.frames / float(said.rate))):
                yield f"sound: {problem}"
            for _ in decode_video(Path(file.name), size, float(said.rate), part=io.BytesIO(data)):
                count += 1
    except UserError as error:
        yield str(error.found or error.message)
        return
    if count != said.frames:
        yield f"{count} pictures, {said.frames} are said"
