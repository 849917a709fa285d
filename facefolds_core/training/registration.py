"""Poses of a head found from the pictures alone: each frame is laid over the subject of one.

The subject of the reference frame (all cameras, one moment: nothing need be known of motion) gives points of its
surface, with what each camera saw there. A pose of another frame moves the points; in the same camera's
picture of that frame they should look alike. The six numbers of a frame follow by Gauss-Newton from coarse to fine,
started from where its neighbour's motion leads; then one number more, how deep the points lie behind what the volume
says, follows from all frames together. Pictures are compared after local normalisation, with Cauchy's
weights: light that is fixed to the room, and a face that performs, count little. So do points far from the cameras'
common centre: shoulders stand still while a head turns, and what is wanted is the head's pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.captures.motion import in_head, is_much
from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.files.writing import atomic_file
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track, own_track
from facefolds_core.params import NormalizeParams
from facefolds_core.progress import progress
from facefolds_core.subject.find import DEFAULT_SUBJECT, find_subject
from facefolds_core.subject.foreign import moved
from facefolds_core.subject.found import reference_frame
from facefolds_core.subject.storage import BODY, Body, write_body
from facefolds_core.subject.volume import Volume, volume_of
from facefolds_core.system.spill import by_rows
from facefolds_core.training.alignment import MIN_COSINE, Equations, Features, Points, features, look_up, refined, unit

Array = NDArray[np.float64]

STRIDE = 3
"""Every n-th pixel of the reference frame's pictures that shows the subject is a point."""

SCALES = (0.032, 0.016, 0.008, 0.004)
"""Blurs from coarse to fine, standard deviations as shares of the picture's shorter side."""

ROUNDS = 3
"""How often the depth of the points is corrected and all frames are aligned anew."""

MAX_DEEPER = 0.01
"""Largest correction of depth, units."""

MIN_OPACITY = 0.9
"""Least opacity of the volume on a ray that gives a point."""

NEARER = 0.25
"""Share of the points that are nearer to the cameras' common centre than one standard deviation of their weight."""

EXTENT = (0.01, 0.99)
"""Quantiles of the points' coordinates between which the subject extends: single points that float do not count."""

MIN_LIKENESS = 0.6
"""A frame is refused, and its pose bridged, if it correlates with the reference less than this share of the median
frame."""

MAX_LEAP = 8.0
"""A frame is refused if its pose lies more degrees than this from the middle of its neighbours'."""


@dataclass(frozen=True)
class Found:
    """Attributes:
    track: the head's own frame -> world.
    degrees, shift: the largest turn, and the largest shift in shares of the subject's extent.
    likeness: (K,) correlation of each frame's pictures with the reference's at the pose found.
    facts: what is to be said.
    body: the subject in the reference frame, in the world, where mattes did not show it.
    """

    track: Track
    degrees: float
    shift: float
    likeness: Array
    facts: tuple[Fact, ...]
    body: Body | None = None


def find_track(scene: Scene) -> Found:
    """Poses of all frames of a scene in which the head is taken to stand still.

    Raises:
        UserError: if the cameras do not look at one place, or nothing stands out from the background.
    """
    subject, mattes = find_subject(scene, DEFAULT_SUBJECT)
    volume, reference = volume_of(subject.splats), reference_frame(scene)
    cameras = [scene.cameras[i] for i in scene.indices("train")]
    points = weighted([surface_points(volume, camera) for camera in cameras])
    frames = scene.num_frames
    with progress(total=frames * (1 + ROUNDS) - 1, desc="poses", unit="frame") as bar:
        poses, likeness = _all_frames(scene, cameras, points, reference, bar)
        for _ in range(ROUNDS):
            points, poses, likeness = _deepened(scene, cameras, points, poses, reference, bar)
    refused = _refused(poses, likeness, reference)
    poses = _bridged(poses, refused)
    cloud = np.concatenate([one.positions for one in points])
    middle = np.average(cloud, axis=0, weights=np.concatenate([one.weight for one in points]))
    track = own_track(poses, np.array([pose.apply(middle) for pose in poses]))
    size = float(np.ptp(np.quantile(cloud, EXTENT, axis=0), axis=0).max())
    shift = max(float(np.linalg.norm(track.at(k).apply(middle) - middle)) for k in range(len(track))) / size
    facts = (fact("poses_refused", frames=[scene.frame_ids[k] for k in refused]),) if refused else ()
    return Found(track, float(track.degrees().max()), shift, likeness, facts, mattes.body)


def surface_points(volume: Volume, camera: Camera) -> Points:
    """Where a camera's rays meet the volume, with normals; what is thin, torn or seen from aside is left out."""
    x = np.arange(STRIDE // 2, camera.width, STRIDE) + 0.5
    y = np.arange(STRIDE // 2, camera.height, STRIDE) + 0.5
    pixels = np.stack(np.meshgrid(x, y), -1)
    origins, directions = camera.rays(pixels)
    flat = [np.broadcast_to(a, directions.shape).reshape(-1, 3).astype(np.float32) for a in (origins, directions)]
    _, alpha, depth = volume.render(*flat)
    alpha, depth = alpha.reshape(pixels.shape[:2]), depth.reshape(pixels.shape[:2]).astype(np.float64)
    there = origins + depth[..., None] * directions
    across, down = np.gradient(there, axis=1), np.gradient(there, axis=0)
    normals = unit(np.cross(across, down))
    normals *= -np.sign((normals * directions).sum(-1, keepdims=True))
    solid = (alpha > MIN_OPACITY) & (depth > 0)
    solid = cv2.erode(solid.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0) > 0
    kept = solid & (-(normals * directions).sum(-1) > MIN_COSINE)
    return Points(there[kept], normals[kept], pixels[kept], np.ones(int(kept.sum())))


def weighted(points: Sequence[Points]) -> list[Points]:
    """The points of all cameras, weighted by a normal distribution about the cameras' common centre.

    Raises:
        UserError: if there are none.
    """
    far = [np.linalg.norm(one.positions, axis=1) for one in points]
    if not sum(map(len, far)):
        raise UserError("no surface of the subject was found", remedy="name where it is: `centre`, `radius`")
    width = float(np.quantile(np.concatenate(far), NEARER))
    return [replace(one, weight=np.exp(-0.5 * (r / width) ** 2)) for one, r in zip(points, far, strict=True)]


def _seen(scene: Scene, points: Sequence[Points], frame: int, sigma: float) -> list[Array]:
    """Of each training camera (P,), what its points look like in a frame, at a scale (pixels)."""
    store = scene.open_frames()
    first = [features(store.image(i, frame), sigma) for i in scene.indices("train")]
    return [look_up(a, p.pixels)[:, 0] for a, p in zip(first, points, strict=True)]


def _all_frames(
    scene: Scene,
    cameras: Sequence[Camera],
    points: Sequence[Points],
    reference: int,
    bar: tqdm,
) -> tuple[list[Similarity], Array]:
    """Poses of all frames against the reference, from it outwards; and their likeness to it."""
    store, indices = scene.open_frames(), scene.indices("train")
    sigmas = [share * min(scene.width, scene.height) for share in SCALES]
    scales = [(sigma, _seen(scene, points, reference, sigma)) for sigma in sigmas]
    poses = [Similarity.identity()] * scene.num_frames
    likeness = np.ones(scene.num_frames)
    for step in (1, -1):
        last = before = Similarity.identity()
        for k in range(reference + step, scene.num_frames if step > 0 else -1, step):
            pose = last.after(before.inverse()).after(last)  # as fast as before
            images = [store.image(i, k) for i in indices]
            for sigma, seen in scales:
                shown = [features(image, sigma) for image in images]
                pose, likeness[k] = refined(pose, cameras, points, shown, seen)
            poses[k], before, last = pose, last, pose
            bar.update()
    return poses, likeness


def _deepened(
    scene: Scene,
    cameras: Sequence[Camera],
    points: Sequence[Points],
    poses: Sequence[Similarity],
    reference: int,
    bar: tqdm,
) -> tuple[list[Points], list[Similarity], Array]:
    """Points moved along their rays by one number for all, as fits all frames best; and the poses with them.

    Half of a volume's opacity is reached before or behind the surface: a head taken to be smaller turns farther.
    """
    store, indices = scene.open_frames(), scene.indices("train")
    sigma = SCALES[-1] * min(scene.width, scene.height)
    seen = _seen(scene, points, reference, sigma)
    found, likeness = list(poses), np.ones(len(poses))

    def shown(k: int) -> list[Features]:
        return [features(store.image(i, k), sigma) for i in indices]

    curvature, slope = 1e-9, 0.0
    for k, pose in enumerate(poses):
        equations = Equations.of(pose, cameras, points, shown(k), seen)
        gain, pull = equations.along_rays()
        curvature, slope = curvature + gain, slope + pull
    deeper = float(np.clip(-slope / curvature, -MAX_DEEPER, MAX_DEEPER))
    moved = [
        replace(one, positions=one.positions + deeper * unit(one.positions - camera.centre))
        for camera, one in zip(cameras, points, strict=True)
    ]
    for k in range(len(poses)):
        if k != reference:
            found[k], likeness[k] = refined(found[k], cameras, moved, shown(k), seen)
        bar.update()
    return moved, found, likeness


def _refused(poses: Sequence[Similarity], likeness: Array, reference: int) -> list[int]:
    """Frames whose pictures are too unlike the reference's at the pose found, or that leap out of the motion."""
    typical = float(np.median(likeness))
    refused = []
    for k, pose in enumerate(poses):
        leaps = False
        if 0 < k < len(poses) - 1:
            between = Track.of(
                [poses[k - 1].rotation, poses[k + 1].rotation], [poses[k - 1].translation, poses[k + 1].translation]
            ).at(0.5)
            off = Track.of([between.inverse().after(pose).rotation], [np.zeros(3)])
            leaps = float(off.degrees()[0]) > MAX_LEAP
        if k != reference and (likeness[k] < MIN_LIKENESS * typical or leaps):
            refused.append(k)
    return refused


def _bridged(poses: Sequence[Similarity], refused: Sequence[int]) -> list[Similarity]:
    """Refused frames between their neighbours; beyond the last that is left, held."""
    kept = [k for k in range(len(poses)) if k not in refused]
    track = Track.of([poses[k].rotation for k in kept], [poses[k].translation for k in kept])
    return [track.at(float(np.interp(k, kept, np.arange(len(kept))))) for k in range(len(poses))]


def with_found_poses(scene: Scene, params: NormalizeParams) -> Scene:
    """The scene with poses found from its pictures, written, where `stabilize` asks for them: "found" always, "auto"
    where the capture has nothing to know them from, and the motion that is found is much.

    Args:
        scene: as it was written; one that has poses stays as it is.

    Raises:
        UserError: see `find_track`; of "found" only.
    """
    asked, wanted = params.stabilize == "found", params.stabilize in ("found", "auto")
    if scene.poses is not None or scene.num_frames < 2 or not wanted:
        return scene
    surface = scene.load_surface()
    if surface is not None and not asked:
        return scene
    try:
        found = find_track(scene)
    except UserError:
        if asked:
            raise
        return scene  # `train` will say what is wrong with the pictures
    much = is_much(found.degrees, found.shift)
    if found.body is not None:
        _keep(found.body, found.track if asked or much else None, scene.folder)
    if not (asked or much):
        return scene
    turns = fact("head_turns", degrees=found.degrees, shift=found.shift, source="found in the pictures")
    scene = replace(scene, poses=found.track, left_out=(*scene.left_out, turns, *found.facts))
    if surface is not None:
        world, faces, track = *surface, found.track
        vertices = by_rows(
            len(world), lambda rows: in_head(world[rows].astype(np.float64), track, rows.start), np.float32
        )
        with atomic_file(scene.folder / "surface.npz") as temporary, temporary.open("wb") as file:
            np.savez(file, vertices=vertices, faces=faces)
    write_scene(scene, scene.folder)
    return scene


def _keep(body: Body, track: Track | None, folder: Path) -> None:
    """Write the body, in the head's own frame, for the stage `subject`."""
    if track is not None:
        body = replace(body, splats=moved(body.splats, track.at(body.frame).inverse()))
    write_body(folder / BODY, body)
