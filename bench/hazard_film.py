"""Pictures in memory: what hazards change, and the clean views that every cell is scored on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures import actor
from facefolds_core.captures.actor import ActorOptions, ActorRig, camera_at, make_rig, write_capture
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.scene import Scene, Split, read_scene, write_scene
from facefolds_core.captures.sources import multiface
from facefolds_core.config.source_code import digest_of_file
from facefolds_core.files.frame_store import Image, write_frames
from facefolds_core.files.writing import atomic_folder
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams, NormalizeParams, Subject

EXTREMES = {"+60": 60.0, "-60": -60.0, "+75": 75.0, "-75": -75.0, "+85": 85.0, "-85": -85.0}
"""Held-out cameras besides the rig's: name -> azimuth, degrees to the head's left; training cameras reach 72."""
EXTREME_ELEVATION = 5.0
PLAN = NormalizeParams(max_azimuth=120)  # where the head's centre is found a little off, +-85 degrees are beyond 90


@dataclass(frozen=True)
class Film:
    """A capture of the actor: one whole cycle of its performance, every twelfth camera of the rig held out."""

    options: ActorOptions = field(default_factory=ActorOptions)
    cameras: int = 24
    frames: int = 4
    height: int = 96
    width: int = 64

    @property
    def key(self) -> str:
        """Names the film and the code that makes it."""
        code = [digest_of_file(path) for path in sorted(Path(actor.__file__).parent.glob("*.py"))]
        return sha256(f"{self!r} {code}".encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Shots:
    """A normalised scene with its pictures.

    Attributes:
        images: (camera, frame) -> (H, W, 3) uint8.
        masks: the same of held-out cameras -> (H, W, 1) uint8.
        surface: tracked mesh, vertices (K, V, 3) and faces (F, 3), or None.
    """

    scene: Scene
    images: dict[tuple[int, int], Image]
    masks: dict[tuple[int, int], Image]
    surface: tuple[NDArray[np.float32], NDArray[np.int32]] | None


def shoot(film: Film, cache: Path) -> Shots:
    """The film through the pipeline's own reader; rendered once, then kept in `cache`."""
    folder = cache / film.key
    if not (folder / "scene.json").exists():
        params = CaptureParams(cameras=film.cameras, frames=film.frames, height=film.height, width=film.width)
        extremes = [camera_at(name, a, EXTREME_ELEVATION, film.width, film.height) for name, a in EXTREMES.items()]
        rig = make_rig(params).cameras
        held = tuple(camera.name for camera in [*rig[11::12], *extremes])
        subject = Subject(source="actor", path="", holdout=held, fps=params.frame_rate)
        with TemporaryDirectory() as raw:
            write_capture(raw, params, options=film.options, rig=ActorRig((*rig, *extremes)))
            capture = multiface.read(Path(raw), subject)
            write_plan(plan_scene(capture, "actor", subject, PLAN, folder), PLAN)
    return read_shots(folder)


def read_shots(folder: Path) -> Shots:
    """A scene's folder, whole in memory."""
    scene = read_scene(folder)
    stores = (scene.open_frames(), scene.open_masks())
    images, masks = ({key: store.image(*key).copy() for key in store} if store else {} for store in stores)
    return Shots(scene, images, masks, scene.load_surface())


def write_shots(shots: Shots, folder: Path) -> Scene:
    """What the trainers read."""
    size = shots.scene.height, shots.scene.width
    with atomic_folder(folder) as temporary:
        write_scene(shots.scene, temporary)
        for name, channels, images in (("frames", 3, shots.images), ("masks", 1, shots.masks)):
            if images:
                rows = ((*key, image) for key, image in sorted(images.items()))
                write_frames(temporary / f"{name}.arrow", (*size, channels), rows)
        if shots.surface is not None:
            np.savez(temporary / "surface.npz", vertices=shots.surface[0], faces=shots.surface[1])
    return read_scene(folder)


def _renumbered(shots: Shots, axis: int, kept: list[int]) -> dict[str, Any]:
    """Images and masks of the cameras (axis 0) or frames (1) that are kept, by their new numbers."""
    pairs = {"images": shots.images, "masks": shots.masks}.items()
    return {
        name: {(*key[:axis], kept.index(key[axis]), *key[axis + 1 :]): p[key] for key in p if key[axis] in kept}
        for name, p in pairs
    }


def keep_cameras(shots: Shots, kept: list[int]) -> Shots:
    """Only these cameras, in their order."""
    at = shots.scene
    scene = replace(at, cameras=tuple(at.cameras[i] for i in kept), splits=tuple(at.splits[i] for i in kept))
    return replace(shots, scene=scene, **_renumbered(shots, 0, kept))


def of_split(shots: Shots, split: Split) -> Shots:
    """The training or the held-out cameras alone."""
    return keep_cameras(shots, shots.scene.indices(split))


def keep_frames(shots: Shots, kept: list[int]) -> Shots:
    """Only these frames; they keep their times."""
    scene = replace(shots.scene, frame_ids=tuple(shots.scene.frame_ids[k] for k in kept), times=shots.scene.times[kept])
    surface = None if shots.surface is None else (shots.surface[0][kept], shots.surface[1])
    return replace(shots, scene=scene, surface=surface, **_renumbered(shots, 1, kept))


def map_cameras(shots: Shots, change: Callable[[int, Camera], Camera]) -> Shots:
    """`change` is given the index and the camera."""
    cameras = tuple(change(i, camera) for i, camera in enumerate(shots.scene.cameras))
    return replace(shots, scene=replace(shots.scene, cameras=cameras))


def map_images(shots: Shots, change: Callable[[int, Image], Image]) -> Shots:
    """`change` is given the camera's index and the picture."""
    return replace(shots, images={key: change(key[0], image) for key, image in shots.images.items()})
