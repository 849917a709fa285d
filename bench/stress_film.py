"""Pictures of the actor in memory: what hazards change, and the clean views that every cell is scored on."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures import actor
from facefolds_core.captures.actor import ActorOptions, ActorRig, camera_at, make_rig, write_capture
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.multiface import read_multiface
from facefolds_core.captures.scene import Scene, read_scene, write_scene
from facefolds_core.files import atomic_folder
from facefolds_core.frame_store import Image, write_frames
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams, NormalizeParams, Subject

EXTREMES: tuple[tuple[str, float], ...] = (
    ("+60", 60.0),
    ("-60", -60.0),
    ("+75", 75.0),
    ("-75", -75.0),
    ("+85", 85.0),
    ("-85", -85.0),
)
"""Held-out cameras besides the rig's: name and azimuth, degrees to the head's left; the outermost training cameras lie
at 72."""

EXTREME_ELEVATION = 5.0


@dataclass(frozen=True)
class Film:
    """A capture of the actor.

    Attributes:
        options: see `ActorOptions`.
        cameras: of the rig, every twelfth of them held out.
        frames: of one whole cycle of the performance.
        height, width: pixels.
    """

    options: ActorOptions = field(default_factory=ActorOptions)
    cameras: int = 24
    frames: int = 4
    height: int = 96
    width: int = 64

    @property
    def key(self) -> str:
        """Names the film and the code that makes it."""
        return sha256(f"{self!r} {source_digest()}".encode()).hexdigest()[:16]


def source_digest() -> int:
    """CRC-32 of the sources of the actor."""
    digest = 0
    for path in sorted(Path(actor.__file__).parent.glob("*.py")):
        digest = zlib.crc32(path.read_bytes(), digest)
    return digest


@dataclass(frozen=True)
class Shots:
    """A normalised scene with its pictures; nothing of it lies on disk.

    Attributes:
        scene: its folder means nothing.
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
        extremes = [camera_at(name, a, EXTREME_ELEVATION, film.width, film.height) for name, a in EXTREMES]
        rig = make_rig(params).cameras
        held_out = tuple(c.name for c in [*rig[11::12], *extremes])
        subject = Subject(source="actor", path="", holdout=held_out)
        with TemporaryDirectory() as raw:
            write_capture(raw, params, options=film.options, rig=ActorRig((*rig, *extremes)))
            capture = read_multiface(Path(raw), subject, params.fps)
            write_plan(plan_scene(capture, "actor", subject, NormalizeParams(), folder), NormalizeParams())
    return read_shots(folder)


def read_shots(folder: Path) -> Shots:
    """A scene's folder, whole in memory."""
    scene = read_scene(folder)
    frames, masks = scene.open_frames(), scene.open_masks()
    return Shots(
        scene=scene,
        images={key: frames.image(*key).copy() for key in frames},
        masks={} if masks is None else {key: masks.image(*key).copy() for key in masks},
        surface=scene.load_surface(),
    )


def write_shots(shots: Shots, folder: Path) -> Scene:
    """What the trainers read."""
    scene = shots.scene
    with atomic_folder(folder) as temporary:
        write_scene(scene, temporary)
        rows = ((*key, image) for key, image in sorted(shots.images.items()))
        write_frames(temporary / "frames.arrow", (scene.height, scene.width, 3), rows)
        if shots.masks:
            rows = ((*key, image) for key, image in sorted(shots.masks.items()))
            write_frames(temporary / "masks.arrow", (scene.height, scene.width, 1), rows)
        if shots.surface is not None:
            np.savez(temporary / "surface.npz", vertices=shots.surface[0], faces=shots.surface[1])
    return read_scene(folder)


def keep_cameras(shots: Shots, kept: list[int]) -> Shots:
    """Only these cameras, in their order."""
    place = {camera: position for position, camera in enumerate(kept)}
    scene = replace(
        shots.scene,
        cameras=tuple(shots.scene.cameras[i] for i in kept),
        splits=tuple(shots.scene.splits[i] for i in kept),
    )
    images = {(place[c], k): image for (c, k), image in shots.images.items() if c in place}
    masks = {(place[c], k): mask for (c, k), mask in shots.masks.items() if c in place}
    return replace(shots, scene=scene, images=images, masks=masks)


def keep_frames(shots: Shots, kept: list[int]) -> Shots:
    """Only these frames; they keep their times."""
    place = {frame: position for position, frame in enumerate(kept)}
    scene = replace(
        shots.scene,
        frame_ids=tuple(shots.scene.frame_ids[k] for k in kept),
        times=shots.scene.times[kept],
    )
    images = {(c, place[k]): image for (c, k), image in shots.images.items() if k in place}
    masks = {(c, place[k]): mask for (c, k), mask in shots.masks.items() if k in place}
    surface = None if shots.surface is None else (shots.surface[0][kept], shots.surface[1])
    return replace(shots, scene=scene, images=images, masks=masks, surface=surface)


def map_cameras(shots: Shots, change: Callable[[int, Camera], Camera]) -> Shots:
    """`change` is given the index and the camera."""
    cameras = tuple(change(i, camera) for i, camera in enumerate(shots.scene.cameras))
    return replace(shots, scene=replace(shots.scene, cameras=cameras))


def map_images(shots: Shots, change: Callable[[int, Image], Image]) -> Shots:
    """`change` is given the camera's index and the picture."""
    return replace(shots, images={key: change(key[0], image) for key, image in shots.images.items()})


def training(shots: Shots) -> Shots:
    """The training cameras alone."""
    return keep_cameras(shots, shots.scene.indices("train"))


def held_out(shots: Shots) -> Shots:
    """The held-out cameras alone."""
    return keep_cameras(shots, shots.scene.indices("holdout"))
