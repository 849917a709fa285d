"""The steps of the export as functions of what they need: the stages call them on files, `pipeline` in a row.

Textures are many and large: they go to and come from frame stores in a folder that the caller gives. Everything else
is passed in memory. Only sampling needs torch, which takes a second to import.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.export.choosing import MESHES, choose_meshes, choose_texels
from facefolds_core.export.collapse import decimated_ladder
from facefolds_core.export.decimation import decimate_layers
from facefolds_core.export.hold import held_rows, shown_rays, texel_weights
from facefolds_core.export.kept import KeptFrames
from facefolds_core.export.stores import Grids, Sheets
from facefolds_core.facts import Fact
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import Surface, TexturedMesh
from facefolds_core.params import BakeParams, DecimateParams, SampleParams, TextureParams

if TYPE_CHECKING:
    from facefolds_core.model.radiance import RadianceManifolds

TEXTURES = "textures.arrow"
"""Name of a frame store of textures, N layers x K frames, in its folder."""

SAMPLED_VIEWS = 3
"""Frames of each training camera that the window is looked for in, where the head turns."""

BAKED_VIEWS = 2
"""Poses in which each training camera sees what shows, where the head turns."""

Surfaces = Sheets | list[Surface]
"""Of all layers, outermost first: the sampled grids themselves, or triangle surfaces."""


def sample_model(
    model: RadianceManifolds,
    cameras: Sequence[Camera],
    params: SampleParams,
    folder: Path,
) -> Grids:
    """N grids of R x R points and normals; the textures of all frames go to `folder`/textures.arrow.

    Args:
        cameras: for training: they decide what the window must hold.
    """
    from facefolds_core.export.sampling import sample_grids, samples_for, write_textures
    from facefolds_core.export.window import visible_window

    window = visible_window(model, cameras) if params.window == "auto" else model.window
    r = samples_for(model, window) if params.resolution == "auto" else params.resolution
    grids = sample_grids(model, r, window)
    opacity = write_textures(folder / TEXTURES, model, grids)
    return replace(grids, opacity=opacity, reflection=model.reflection_maps(), torso=model.torso)


def decimate_all(
    surfaces: Surfaces, grids: Grids, scene: Scene, samples: Path, params: DecimateParams, levels: Sequence[int]
) -> tuple[list[TexturedMesh], dict[int, list[TexturedMesh]], Fact | None]:
    """The meshes that ship, and those of the coarser levels of detail.

    Args:
        scene: whose photos decide where `resolution` is "auto".
        samples: frame store of the textures as they were sampled.
        levels: R^m of the coarser levels.

    Returns:
        meshes of all layers, outermost first; R^m of a coarser level -> its meshes, never finer than those; and how R^m
        was chosen, None where it was given.
    """
    given = params.resolution
    tried = MESHES if given == "auto" else (given,)
    wanted = sorted({*tried, *levels})
    if isinstance(surfaces, Sheets):
        by_count = decimated_ladder(surfaces, [r**2 for r in wanted])
        ladder = {r: by_count[r**2] for r in wanted}
    else:
        ladder = {r: decimate_layers(surfaces, grids, r, params) for r in wanted}
    chosen, why = (given, None) if given != "auto" else choose_meshes(scene, ladder, grids, FrameStore(samples))
    return ladder[chosen], {r: ladder[min(r, chosen)] for r in levels}, why


def texels_for(
    scene: Scene, meshes: Sequence[TexturedMesh], grids: Grids, samples: Path, params: TextureParams
) -> tuple[int, Fact | None]:
    """R^t, and how it was chosen; None where it was given. `samples`: see `decimate_all`."""
    if params.resolution == "auto":
        return choose_texels(scene, meshes, grids, FrameStore(samples))
    return params.resolution, None


def bake(
    cameras: Sequence[Camera],
    grids: Grids,
    meshes: Sequence[TexturedMesh],
    textures: Path,
    params: BakeParams,
    folder: Path,
    kept: Path | None = None,
) -> int:
    """Textures that ship: held where a change would not show, into `folder`/textures.arrow.

    Args:
        cameras: for training.
        textures: frame store of the textures at the size that ships.
        kept: folder of what an earlier run made, from which frames are taken over that would be the same; or None.

    Returns:
        rays by which it was seen what shows; 0 if the textures were left as they are.

    Raises:
        UserError: if meshes and textures are not of the same layers.
    """
    path, store = folder / TEXTURES, FrameStore(textures)
    layers = {len(meshes), grids.num_layers, 1 + max(layer for layer, _ in store)}
    if len(layers) > 1:
        raise UserError(
            "meshes, samples and textures do not belong together",
            file=textures,
            expected="as many layers in each",
            found=sorted(layers),
            remedy="run `dvc repro`, which makes them again",
        )
    if params.hold == 0 or not any(frame > 0 for _, frame in store):
        shutil.copyfile(textures, path)
        return 0
    rays = shown_rays(cameras, meshes, grids.opacity)
    weights = texel_weights(rays, store, len(cameras))
    earlier = KeptFrames(kept)
    rows = held_rows(store, weights, params.hold, folder, earlier)
    write_frames(path, (store.height, store.width, 4), rows, packed=True)
    earlier.keep(path)
    return len(rays)
