"""Each surface with at most R^m x R^m vertices, and texture coordinates, for all levels: data/<subject>/meshes."""

from __future__ import annotations

from collections.abc import Sequence

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.config.stages import read_level_resolutions, read_stage
from facefolds_core.export.choosing import MESHES, choose_meshes
from facefolds_core.export.collapse import decimated_ladder
from facefolds_core.export.decimation import decimate_layers
from facefolds_core.export.stores import TEXTURES, Grids, Sheets, read_grids, read_surfaces, write_meshes
from facefolds_core.facts import Fact
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder
from facefolds_core.geometry.meshes import Surface, TexturedMesh
from facefolds_core.params import DecimateParams
from facefolds_core.pipeline.choices import write_choice


def decimate(folders: SubjectFolders) -> str:
    params = read_stage(DecimateParams, folders.config)
    surfaces = read_surfaces(folders.surfaces / "surfaces.npz")
    grids = read_grids(folders.samples / "grids.npz")
    levels, samples = read_level_resolutions(folders.config), FrameStore(folders.samples / TEXTURES)
    meshes, coarse, chosen = decimate_all(surfaces, grids, read_scene(folders.scene), samples, params, levels)
    with atomic_folder(folders.meshes) as temporary:
        write_meshes(temporary / "meshes.npz", meshes)
        for resolution, coarser in coarse.items():
            write_meshes(temporary / f"level_{resolution}.npz", coarser)
        why = write_choice(temporary, chosen)
    vertices, triangles = sum(len(m.vertices) for m in meshes), sum(len(m.faces) for m in meshes)
    others = "".join(f"; R^m {r}: {sum(len(m.faces) for m in found)} triangles" for r, found in coarse.items())
    return f"{len(meshes)} meshes, {vertices} vertices, {triangles} triangles{others}; in {folders.meshes}{why}"


def decimate_all(
    surfaces: Sheets | list[Surface],
    grids: Grids,
    scene: Scene,
    samples: FrameStore,
    params: DecimateParams,
    levels: Sequence[int],
) -> tuple[list[TexturedMesh], dict[int, list[TexturedMesh]], Fact | None]:
    """The meshes that ship, and those of the coarser levels of detail.

    Args:
        scene: whose photos decide where `resolution` is "auto".
        samples: the textures as they were sampled.
        levels: R^m of the coarser levels.

    Returns:
        meshes of all layers, outermost first; R^m of a coarser level -> its meshes, never finer than those; and how R^m
        was chosen, None where it was given.
    """
    given = params.resolution
    wanted = sorted({*(MESHES if given == "auto" else (given,)), *levels})
    if isinstance(surfaces, Sheets):
        by_count = decimated_ladder(surfaces, [r**2 for r in wanted])
        ladder = {r: by_count[r**2] for r in wanted}
    else:
        ladder = {r: decimate_layers(surfaces, grids, r, params) for r in wanted}
    chosen, why = (given, None) if given != "auto" else choose_meshes(scene, ladder, grids, samples)
    return ladder[chosen], {r: ladder[min(r, chosen)] for r in levels}, why
