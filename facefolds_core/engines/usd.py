"""OpenUSD: all frames, textures sampled in time (a folder with face.usdc, or one file where OUT ends in .usdz).

A Mesh and a Material (UsdPreviewSurface) for each layer. Light that the surface sends out is the texture's colour, its
opacity the texture's alpha; nothing is lit. Every frame is one JPEG with the colours above the alphas, as the asset's
video has them: `primvars:st` leads to the one, `primvars:st_alpha` to the other (v up). `primvars:facefolds:layer`
counts the layers from the outermost, 0. The stage is y up, the subject looks to +z; a unit is taken as a metre, which
is right where the cameras stood about a metre away. A time code is a frame.

Renderers decode colours to linear light and blend every crossing of a sheet, which the format does not ask for
(docs/guide/engines.md): therefore backs are left out, and triangles are listed from the back to the front.
The reflection cannot be said in UsdPreviewSurface.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.asset.glb import back_to_front
from facefolds_core.asset.manifest import Texture
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.engines._folder import in_words, refuse_other_content, rgb_picture
from facefolds_core.errors import UserError
from facefolds_core.files.writing import atomic_file, atomic_folder
from facefolds_core.geometry.meshes import TexturedMesh

STAGE = "face.usdc"
PICTURE = "textures/frame_{:05d}.jpg"
QUALITY = 95
"""Of the pictures: JPEG without subsampled chroma, 0..100."""


def export(out: Path, level: AssetLevel, subject: str) -> str:
    """Write a level into a folder (`face.usdc`, `textures/`), which is replaced, or into a package, `*.usdz`.

    Raises:
        UserError: if usd-core is not installed, the folder holds anything else than an earlier export, or the asset's
            video is damaged.
    """
    pxr = _load()
    if out.suffix.lower() == ".usdz":
        with atomic_file(out) as temporary, tempfile.TemporaryDirectory(dir=temporary.parent) as parts:
            write_files(pxr, Path(parts), level, subject)
            pack(pxr, Path(parts), temporary)
        return in_words(level, out)
    refuse_other_content(out, STAGE)
    with atomic_folder(out) as place:
        write_files(pxr, place, level, subject)
        return in_words(level, place)


def write_files(pxr: Any, folder: Path, level: AssetLevel, subject: str) -> None:
    """The stage and a picture a frame."""
    (folder / PICTURE).parent.mkdir()
    write_stage(pxr, folder / STAGE, level, subject)
    for number, picture in enumerate(level.pictures()):
        image = Image.fromarray(rgb_picture(picture, level.entry.texture))
        image.save(folder / PICTURE.format(number), quality=QUALITY, subsampling=0)


def pack(pxr: Any, folder: Path, out: Path) -> None:
    """All files of a folder as a package: stored, aligned, the stage first.

    Raises:
        UserError: if it cannot be written.
    """
    files = sorted((path for path in folder.rglob("*") if path.is_file()), key=lambda path: (path.name != STAGE, path))
    with pxr.Sdf.ZipFileWriter.CreateNew(str(out)) as writer:
        for path in files:
            if not writer.AddFile(str(path), str(path.relative_to(folder))):
                raise UserError("the package could not be written", file=out, remedy="export to a folder instead")


def _load() -> Any:
    """The modules of usd-core.

    Raises:
        UserError: if it is not installed.
    """
    try:
        from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt
    except ModuleNotFoundError:
        raise UserError("the package usd-core is not installed", remedy="pip install 'facefolds[usd]'") from None
    return SimpleNamespace(Gf=Gf, Sdf=Sdf, Usd=Usd, UsdGeom=UsdGeom, UsdShade=UsdShade, Vt=Vt)


def write_stage(pxr: Any, path: Path, level: AssetLevel, subject: str) -> None:
    """The stage, which names its pictures as they lie beside it."""
    texture = level.entry.texture
    stage = pxr.Usd.Stage.CreateNew(str(path))
    pxr.UsdGeom.SetStageUpAxis(stage, pxr.UsdGeom.Tokens.y)
    pxr.UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(texture.fps)
    stage.SetFramesPerSecond(texture.fps)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(texture.frames - 1)
    stage.SetMetadata("comment", f"facefolds: {subject}")
    root = pxr.UsdGeom.Xform.Define(stage, "/Face")
    stage.SetDefaultPrim(root.GetPrim())
    pxr.Usd.ModelAPI(root).SetKind("component")
    turned = pxr.Gf.Matrix4d(0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1)  # rows: where x, y and z go
    root.AddTransformOp().Set(turned)
    head = pxr.UsdGeom.Xform.Define(stage, "/Face/Head")
    if level.track is not None:
        move, turn = head.AddTranslateOp(), head.AddOrientOp()
        for frame, (q, t) in enumerate(zip(level.track.quaternions, level.track.translations, strict=True)):
            move.Set(pxr.Gf.Vec3d(*t.tolist()), frame)
            turn.Set(pxr.Gf.Quatf(*q.tolist()), frame)
    pxr.UsdGeom.Scope.Define(stage, "/Face/Materials")
    for index in reversed(
        range(level.num_layers)
    ):  # from the innermost: what draws in the stage's order draws it first
        name = f"layer_{index:02d}"
        material = write_material(pxr, stage, f"/Face/Materials/{name}", texture.frames)
        mesh = write_mesh(pxr, stage, f"/Face/Head/{name}", level, index)
        pxr.UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.GetRootLayer().Save()


def write_mesh(pxr: Any, stage: Any, path: str, level: AssetLevel, index: int) -> Any:
    mesh, vt, sdf = level.layers[index], pxr.Vt, pxr.Sdf.ValueTypeNames
    prim = pxr.UsdGeom.Mesh.Define(stage, path)
    faces = back_to_front(mesh)
    prim.CreatePointsAttr(vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.vertices, np.float32)))
    prim.CreateFaceVertexIndicesAttr(vt.IntArray.FromNumpy(np.ascontiguousarray(faces.ravel(), np.int32)))
    prim.CreateFaceVertexCountsAttr(vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
    prim.CreateSubdivisionSchemeAttr(pxr.UsdGeom.Tokens.none)
    prim.CreateDoubleSidedAttr(False)
    corners = np.stack([mesh.vertices.min(0), mesh.vertices.max(0)]).astype(np.float32)
    prim.CreateExtentAttr(vt.Vec3fArray.FromNumpy(corners))
    primvars = pxr.UsdGeom.PrimvarsAPI(prim)
    texture, rect = level.entry.texture, level.entry.layers[index].texture_rect
    for name, half in (("st", texture.colour_rect), ("st_alpha", texture.alpha_rect)):
        values = in_picture(mesh, texture, rect, half)
        primvar = primvars.CreatePrimvar(name, sdf.TexCoord2fArray, pxr.UsdGeom.Tokens.vertex)
        primvar.Set(vt.Vec2fArray.FromNumpy(values))
    primvars.CreatePrimvar("facefolds:layer", sdf.Int, pxr.UsdGeom.Tokens.constant).Set(index)
    return prim


def in_picture(
    mesh: TexturedMesh, texture: Texture, rect: tuple[int, ...], half: tuple[int, ...]
) -> NDArray[np.float32]:
    """(V, 2) places in the whole picture, v up, of a layer's vertices in the colours' or the alphas' part."""
    at = np.array([half[0] + rect[0], half[1] + rect[1]]) + mesh.st.astype(np.float64) * [rect[2], rect[3]]
    place = at / [texture.width, texture.height]
    return np.stack([place[:, 0], 1 - place[:, 1]], 1).astype(np.float32)


def write_material(pxr: Any, stage: Any, path: str, frames: int) -> Any:
    """A surface that shines with the texture's colour where its alpha has it present."""
    sdf, shade = pxr.Sdf.ValueTypeNames, pxr.UsdShade
    material = shade.Material.Define(stage, path)
    surface = shade.Shader.Define(stage, f"{path}/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    black = pxr.Gf.Vec3f(0, 0, 0)
    surface.CreateInput("diffuseColor", sdf.Color3f).Set(black)
    surface.CreateInput("useSpecularWorkflow", sdf.Int).Set(1)
    surface.CreateInput("specularColor", sdf.Color3f).Set(black)
    surface.CreateInput("roughness", sdf.Float).Set(1.0)
    surface.CreateInput("opacityMode", sdf.Token).Set("presence")
    for name, primvar, space, output, wanted in (
        ("colour", "st", "sRGB", ("rgb", sdf.Float3), ("emissiveColor", sdf.Color3f)),
        ("alpha", "st_alpha", "raw", ("r", sdf.Float), ("opacity", sdf.Float)),
    ):
        reader = shade.Shader.Define(stage, f"{path}/{name}_place")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", sdf.String).Set(primvar)
        place = reader.CreateOutput("result", sdf.Float2)
        image = shade.Shader.Define(stage, f"{path}/{name}")
        image.CreateIdAttr("UsdUVTexture")
        file = image.CreateInput("file", sdf.Asset)
        file.Set(PICTURE.format(0))  # for what knows no time
        for frame in range(frames if frames > 1 else 0):
            file.Set(PICTURE.format(frame), frame)
        image.CreateInput("st", sdf.Float2).ConnectToSource(place)
        image.CreateInput("sourceColorSpace", sdf.Token).Set(space)
        for wrap in ("wrapS", "wrapT"):
            image.CreateInput(wrap, sdf.Token).Set("clamp")
        surface.CreateInput(*wanted).ConnectToSource(image.CreateOutput(*output))
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", sdf.Token))
    return material
