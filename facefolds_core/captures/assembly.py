"""Put a capture into the normalised form: decide everything, check every header, then write the scene in one go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.agreement import AGREE, agreement
from facefolds_core.captures.capture import Capture, check_image_sizes, complete_subset
from facefolds_core.captures.images import decode_image, decode_mask, display_colour, downsample, fit_box, to_8bit
from facefolds_core.captures.lens import Lens, undistort
from facefolds_core.captures.motion import head_motion, in_head
from facefolds_core.captures.normalization import cull, normalizing_similarity, split_cameras
from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.captures.sound import cut_sound, sound_start
from facefolds_core.captures.visibility import check_sight
from facefolds_core.facts import Fact, fact
from facefolds_core.files import atomic_folder
from facefolds_core.frame_store import FrameStore, Image, write_frames
from facefolds_core.params import NormalizeParams, Subject
from facefolds_core.progress import progress


@dataclass(frozen=True)
class Row:
    """One image of the scene and where it comes from.

    Attributes:
        camera, frame: indices in the scene.
        source: (camera index, frame index) in the capture.
    """

    camera: int
    frame: int
    source: tuple[int, int]


@dataclass(frozen=True)
class Plan:
    """The scene that will be written.

    Attributes:
        capture: what it is made from.
        scene: all of it but pixels and mesh.
        rows: its images, ordered by camera, then frame.
        vertices: (K, V, 3) float32 tracked mesh in the head's own frame, or None.
        sound_start: seconds, where the first frame lies in the capture's sound; None without a sound that fits.
    """

    capture: Capture
    scene: Scene
    rows: tuple[Row, ...]
    vertices: NDArray[np.float32] | None
    sound_start: float | None = None


def plan_scene(capture: Capture, name: str, subject: Subject, params: NormalizeParams, folder: Path) -> Plan:
    """Decide cameras, frames, split and coordinates, and check the headers of all images in use.

    Args:
        name: of the subject.
        folder: where the scene will be written.

    Raises:
        UserError: for everything that is wrong with the capture and shows without decoding its images.
    """
    similarity, notes = normalizing_similarity(capture, subject.front)
    culling = cull([view.camera.transformed(similarity) for view in capture.views], params, capture.root)
    kept, frames, incomplete = complete_subset(capture, culling.kept)
    left_out = [*capture.left_out, *notes, *culling.facts, *incomplete]
    fps = capture.fps if len(frames) > 1 else 0.0
    sound = None if capture.sound is None else sound_start([capture.sound.seconds[f] for f in frames], fps)
    if capture.sound is not None and sound is None:
        left_out.append(fact("sound_does_not_fit", file=capture.sound.path.name))
    splits = split_cameras([capture.views[c].name for c in kept], subject, left_out, capture.root)
    width, height = fit_box(*check_image_sizes(capture, kept, frames), params.long_side, params.short_side)

    cameras = [capture.views[c].camera.resized(width, height).transformed(similarity) for c in kept]
    rows = [Row(i, f, (c, source)) for i, c in enumerate(kept) for f, source in enumerate(frames)]
    motion = head_motion(capture, frames, similarity, params)
    left_out += motion.facts
    scene = Scene(
        subject=name,
        cameras=tuple(cameras),
        splits=splits,
        frame_ids=tuple(capture.frame_ids[f] for f in frames),
        times=np.arange(len(frames)) / (capture.fps or 1.0),
        fps=fps,
        from_capture=similarity,
        left_out=tuple(left_out),
        folder=folder,
        poses=motion.track,
    )
    vertices, there = None, None
    if capture.tracking is not None:
        there = similarity.apply(capture.tracking.world_vertices()[frames])
        vertices = in_head(there, motion.track).astype(np.float32)
    check_sight(cameras, scene.frame_ids, None if there is None else there.astype(np.float32), capture.root)
    return Plan(capture, scene, tuple(rows), vertices, sound)


def write_plan(plan: Plan, params: NormalizeParams) -> Scene:
    """Write the scene's folder, whole or not at all; one image is held in memory at a time.

    Returns:
        The scene, with what its pictures show to be odd in `left_out`.

    Raises:
        UserError: if an image is damaged.
    """
    scene, capture = plan.scene, plan.capture
    masked = [row for row in plan.rows if scene.splits[row.camera] == "holdout" and row.source in capture.masks]
    with atomic_folder(scene.folder) as temporary:
        shape = (scene.height, scene.width, 3)
        write_frames(temporary / "frames.arrow", shape, _photos(plan, params))
        if masked:
            write_frames(temporary / "masks.arrow", (scene.height, scene.width, 1), _masks(plan, masked))
        if plan.vertices is not None and capture.tracking is not None and capture.tracking.faces is not None:
            np.savez(temporary / "surface.npz", vertices=plan.vertices, faces=capture.tracking.faces)
        if capture.sound is not None and plan.sound_start is not None:
            seconds = scene.num_frames / (scene.fps or 1.0)
            cut_sound(capture.sound.path, temporary / "audio.wav", plan.sound_start, seconds)
        scene = replace(scene, left_out=(*_doubts(plan, temporary), *scene.left_out))
        write_scene(scene, temporary)
    return scene


def _doubts(plan: Plan, written: Path) -> list[Fact]:
    """A note if the pictures of the first frame do not agree about the tracked mesh."""
    tracking = plan.capture.tracking
    if plan.vertices is None or tracking is None or tracking.faces is None:
        return []
    first = [row.camera for row in plan.rows if row.frame == 0]
    store = FrameStore(written / "frames.arrow")
    cameras, vertices = [plan.scene.camera_in_head(c, 0) for c in first], plan.vertices[0].astype(np.float64)
    found = agreement(cameras, vertices, tracking.faces, lambda i: store.image(first[i], 0))
    if found is None or found >= AGREE:
        return []
    return [fact("pictures_disagree", correlation=found)]


def _photos(plan: Plan, params: NormalizeParams) -> Iterator[tuple[int, int, Image]]:
    capture, scene = plan.capture, plan.scene
    for row in progress(plan.rows, desc="normalize", unit="image"):
        photo = decode_image(capture.images[row.source], capture.place(*row.source))
        values = downsample(_straight(plan, row, photo), scene.width, scene.height)
        yield row.camera, row.frame, to_8bit(display_colour(values) if params.display_colour else values)


def _masks(plan: Plan, rows: list[Row]) -> Iterator[tuple[int, int, Image]]:
    capture, scene = plan.capture, plan.scene
    for row in rows:
        mask = decode_mask(capture.masks[row.source], f"mask of {capture.place(*row.source)}")
        yield row.camera, row.frame, to_8bit(downsample(_straight(plan, row, mask), scene.width, scene.height))


def _straight(plan: Plan, row: Row, photo: Image) -> Image:
    """The photo without distortion."""
    lens = plan.capture.views[row.source[0]].lens
    if lens is None:
        return photo
    return undistort(photo, _maps(lens, photo.shape[1], photo.shape[0]))


@lru_cache(maxsize=1)
def _maps(lens: Lens, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """`Lens.maps`, kept while the frames of one camera are read."""
    return lens.maps(width, height)
