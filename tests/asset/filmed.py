"""The synthetic caps, filmed: a scene with gloss, and the asset that packaging makes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.packaging.package import Export, package
from facefolds_core.params import CompressParams, merged
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import composite
from tests.assets import CENTRE, PLAIN, WINDOW, cap_mesh, cap_textures, radius_of, write_store
from tests.scenes import look_at_origin

SIZE, LAYERS, FRAMES, R = 48, 3, 3, 64
HELD_OUT = 8


def filmed(folder: Path) -> Scene:
    """The caps before any loss, as cameras saw them, with gloss: brighter from one side."""
    cameras = tuple(look_at_origin(f"c{i}", azimuth, 8, SIZE) for i, azimuth in enumerate(range(-40, 45, 8)))
    scene = Scene(
        subject="caps",
        cameras=cameras,
        splits=tuple("holdout" if i == HELD_OUT else "train" for i in range(len(cameras))),
        frame_ids=tuple(map(str, range(FRAMES))),
        times=np.arange(FRAMES) / 30,
        fps=30.0,
        from_capture=Similarity.identity(),
        left_out=(),
        folder=folder,
    )
    folder.mkdir(parents=True)
    meshes = [cap_mesh(radius_of(i)) for i in range(LAYERS)]
    rows = []
    for i, camera in enumerate(cameras):
        hits = cast_layers(camera, meshes)
        for k in range(FRAMES):
            rgb, alpha = composite(hits, list(cap_textures(LAYERS, k, R)))
            gloss = (0.15 * camera.centre[1] * alpha)[..., None]
            rows.append((i, k, np.rint(255 * np.clip(rgb + gloss, 0, 1)).astype(np.uint8)))
    write_frames(folder / "frames.arrow", (SIZE, SIZE, 3), rows)
    write_scene(scene, folder)
    return scene


def packaged(folder: Path, scene: Scene, section: dict[str, Any], reflection: ReflectionMaps | None = None) -> None:
    """Package the caps with the section `compress`."""
    store = folder.with_name("textures.arrow")
    textures = write_store(store, np.stack([cap_textures(LAYERS, frame, R) for frame in range(FRAMES)]))

    def caps(side: int) -> list[TexturedMesh]:
        return [cap_mesh(radius_of(i), side) for i in range(LAYERS)]

    levels = {level["mesh_resolution"] for level in section.get("levels", ())}
    export = Export(caps(12), [WINDOW] * LAYERS, textures, CENTRE, {r: caps(r) for r in levels}, reflection)
    package(folder, export, scene, CompressParams.model_validate(merged(PLAIN.model_dump(), section)))
