"""Put a capture into the normalised form: decide everything, check every header, then write the scene in one go."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Capture, check_image_sizes, complete_subset
from facefolds_core.captures.developing import Negative, opacities, photos
from facefolds_core.captures.images import fit_box
from facefolds_core.captures.motion import head_motion, in_head
from facefolds_core.captures.normalization import cull, normalizing_similarity, split_cameras
from facefolds_core.captures.picture import Picture
from facefolds_core.captures.place import draw_place
from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.captures.sound import cut_sound, sound_start
from facefolds_core.captures.visibility import check_sight
from facefolds_core.errors import UserError
from facefolds_core.facts import fact
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import NormalizeParams, Subject
from facefolds_core.progress import progress
from facefolds_core.system.spill import by_rows

Rows = dict[tuple[int, int], tuple[int, int]]

BALL = (0.02, 0.95)
"""Radii of the subject's ball in distances of the cameras: an eye would fill it, and beyond it the cameras stand."""


@dataclass(frozen=True)
class Plan:
    """The scene that will be written.

    Attributes:
        capture: what it is made from.
        scene: all of it but pixels and mesh.
        rows: its images, (camera, frame) in the scene -> in the capture, ordered by camera, then frame.
        vertices: (K, V, 3) float32 tracked mesh in the head's own frame, or None.
        sound_start: seconds, where the first frame lies in the capture's sound; None without a sound that fits.
    """

    capture: Capture
    scene: Scene
    rows: Rows
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
    similarity, notes = normalizing_similarity(capture, subject.front, subject.centre)
    inside, culled = cull([view.camera.transformed(similarity) for view in capture.views], params, capture.root)
    kept, frames, incomplete = complete_subset(capture, inside)
    left_out = [*capture.left_out, *notes, *culled, *incomplete]
    fps = capture.fps if len(frames) > 1 else 0.0
    sound = None if capture.sound is None else sound_start([capture.sound.seconds[f] for f in frames], fps)
    if capture.sound is not None and sound is None:
        left_out.append(fact("sound_does_not_fit", file=capture.sound.path.name))
    splits = split_cameras([capture.views[c].name for c in kept], subject, left_out, capture.root)
    width, height = fit_box(*check_image_sizes(capture, kept, frames), params.long_side, params.short_side)

    cameras = [capture.views[c].camera.resized(width, height).transformed(similarity) for c in kept]
    rows = {(i, f): (c, source) for i, c in enumerate(kept) for f, source in enumerate(frames)}
    track, motion = head_motion(capture, frames, similarity, params)
    left_out += motion
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
        poses=track,
        radius=None if subject.radius is None else _ball(similarity.scale * subject.radius, capture),
    )
    vertices, there = None, None
    if capture.tracking is not None:
        world = capture.tracking.world_vertices(frames)
        normalised = by_rows(len(world), lambda rows: similarity.apply(world[rows]))
        vertices = by_rows(len(world), lambda rows: in_head(normalised[rows], track, rows.start), np.float32)
        there = by_rows(len(world), lambda rows: normalised[rows], np.float32)
    check_sight(cameras, scene.frame_ids, there, capture.root)
    return Plan(capture, scene, rows, vertices, sound)


def _ball(radius: float, capture: Capture) -> float:
    """The radius of the subject's ball, units."""
    least, most = BALL
    if least <= radius <= most:
        return radius
    raise UserError(
        "the ball is much too small or too large",
        file=capture.root,
        place="radius",
        expected=f"{least:g} to {most:g} times the median distance of the cameras from the subject's centre",
        found=f"{radius:.3g} times it",
        remedy="give `radius` of this subject in the capture's unit of length, or leave it out",
    )


def write_plan(plan: Plan, params: NormalizeParams) -> Scene:
    """Write the scene's folder, whole or not at all; a few images are held in memory at a time.

    Raises:
        UserError: if an image is damaged.
    """
    scene, capture = plan.scene, plan.capture
    width, height = scene.width, scene.height
    scored = {key: source for key, source in plan.rows.items() if scene.splits[key[0]] != "train"}
    opacity = {
        "masks": _negatives(scored, capture.masks, lambda c, f: f"mask of {capture.place(c, f)}"),
        "mattes": _negatives(plan.rows, capture.mattes, lambda c, f: f"matte of {capture.place(c, f)}"),
    }
    shown = _negatives(plan.rows, capture.images, capture.place)
    with atomic_folder(scene.folder) as temporary:
        rows = progress(photos(capture, shown, width, height, params), desc="normalize", unit="image", total=len(shown))
        write_frames(temporary / "frames.arrow", (height, width, 3), rows)
        for name, wanted in opacity.items():
            if wanted:
                rows = opacities(capture, wanted, width, height)
                write_frames(temporary / f"{name}.arrow", (height, width, 1), rows)
        plates = [
            Negative(key, view, capture.plates[view], capture.plate_place(view))
            for key, (view, _) in plan.rows.items()
            if key[1] == 0 and view in capture.plates
        ]
        if plates:
            rows = photos(capture, plates, width, height, params)
            write_frames(temporary / "plates.arrow", (height, width, 3), rows)
        if plan.vertices is not None and capture.tracking is not None and capture.tracking.faces is not None:
            np.savez(temporary / "surface.npz", vertices=plan.vertices, faces=capture.tracking.faces)
        if capture.sound is not None and plan.sound_start is not None:
            seconds = scene.num_frames / (scene.fps or 1.0)
            cut_sound(capture.sound.path, temporary / "audio.wav", plan.sound_start, seconds)
        draw_place(temporary / "place.png", scene, FrameStore(temporary / "frames.arrow"))
        write_scene(scene, temporary)
    return scene


def _negatives(rows: Rows, pictures: Mapping[tuple[int, int], Picture], what: Callable[..., str]) -> list[Negative]:
    """Of those rows that have a picture; `what` words its camera and frame in the capture."""
    there = {key: source for key, source in rows.items() if source in pictures}
    return [Negative(key, source[0], pictures[source], what(*source)) for key, source in there.items()]
