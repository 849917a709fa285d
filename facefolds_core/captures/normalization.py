"""From a capture's world to the normalised one: centre, orientation, scale; cameras culled and held out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from facefolds_core.captures.capture import Capture, Tracking
from facefolds_core.captures.motion import middles
from facefolds_core.captures.scene import Split
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.geometry.cameras import Array, Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.params import HoldoutEvery, NormalizeParams, Subject

WELL_BESIDE = 60.0
"""Degrees: how far beside the front a camera still counts as one that faces the subject, in words only."""


def orientation(facing: Array, up: Array) -> Array:
    """(3, 3) rotation that takes `facing` to +x and `up`, made orthogonal to it, to +z."""
    x = facing / np.linalg.norm(facing)
    z = up - (up @ x) * x
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])


def nearest_to_axes(cameras: Sequence[Camera]) -> Array:
    """(3,) the point nearest to all optical axes, robustly: a camera that looks elsewhere counts little.

    Minimises sum_i w_i |(I - d_i d_i^T)(p - o_i)|^2, reweighted 30 times with w_i = 1 / (1 + (r_i / (2 median r))^2)
    (Cauchy's weights). Two parallel axes leave the position along them open: the least-norm solution is taken there.
    """
    origins = np.array([camera.centre for camera in cameras])
    directions = np.array([camera.forward for camera in cameras])
    projectors = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    weights = np.ones(len(cameras))
    middle = origins.mean(0)
    point = middle
    for _ in range(30):
        A = (weights[:, None, None] * projectors).sum(0)
        b = (weights[:, None] * np.einsum("nij,nj->ni", projectors, origins - middle)).sum(0)
        point = middle + np.linalg.lstsq(A, b, rcond=1e-9)[0]
        residuals = np.linalg.norm(np.einsum("nij,nj->ni", projectors, point - origins), axis=1)
        scale = 2 * np.median(residuals) + 1e-12
        weights = 1 / (1 + (residuals / scale) ** 2)
    return np.asarray(point)


def _from_tracking(tracking: Tracking) -> tuple[Array, Array]:
    """Centre (3,) and rotation (3, 3) from the tracked head, averaged over the frames, in the capture's world.

    The centre is the middle of the bounding box: unlike the mean of the vertices it does not depend on where the mesh
    is dense (eyes, lips).
    """
    facing, up = tracking.poses[:, :, 2].mean(0), tracking.poses[:, :, 1].mean(0)
    if min(np.linalg.norm(facing), np.linalg.norm(up), np.linalg.norm(np.cross(facing, up))) < 0.1:
        raise UserError(
            "the head poses contradict one another",
            place="tracked_mesh/SEGMENT/FRAME_transform.txt",
            expected="a head that faces about the same way in all frames",
            found=f"mean direction {facing.tolist()}, mean up {up.tolist()}",
            remedy="copy the head poses again, or choose other frames for this subject in params.yaml",
        )
    return middles(tracking.world_vertices()).mean(0), orientation(facing, up)


def find_front(cameras: Sequence[Camera], centre: Array, file: object) -> tuple[Array, Array, Fact]:
    """Where the subject faces and its up (3,), from where the cameras stand, and a fact that says so.

    A rig has most of its cameras before the face, evenly to both sides: the front is the mean of the directions to the
    cameras, made level, since rigs have more room above the face than below. Up is the median of the cameras' ups:
    some may be turned on their sides.
    """
    towards = np.array([camera.centre - centre for camera in cameras])
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    up = _median_direction(np.array([-camera.rotation[1] for camera in cameras]))
    level = towards - (towards @ up)[:, None] * up
    facing = level.mean(0)
    size = float(np.linalg.norm(facing))
    if not size > 1e-6:
        raise UserError(
            "the cameras do not tell where the subject faces",
            file=str(file),
            place="front",
            remedy="set `front` of this subject in params.yaml to a camera that faces it, upright",
        )
    along = towards @ facing / size
    before = float((along > np.cos(np.radians(WELL_BESIDE))).mean())
    nearest = cameras[int(np.argmax(along))].name
    return facing, up, fact("front_found", camera=nearest, share=before)


def _median_direction(directions: Array) -> Array:
    """(3,) unit: the geometric median (Weiszfeld's iteration) of unit directions (n, 3)."""
    point = directions.mean(0)
    for _ in range(50):
        weights = 1 / np.maximum(np.linalg.norm(directions - point, axis=1), 1e-6)
        point = weights @ directions / weights.sum()
    return np.asarray(point / max(float(np.linalg.norm(point)), 1e-12))


def _from_cameras(capture: Capture, front: str | None) -> tuple[Array, Array, list[Fact]]:
    """Centre (3,), rotation (3, 3) and facts, from the cameras alone."""
    cameras = [view.camera for view in capture.views]
    centre = nearest_to_axes(cameras)
    if front is None:
        facing, up, note = find_front(cameras, centre, capture.root)
        return centre, orientation(facing, up), [note]
    names = [camera.name for camera in cameras]
    if front not in names:
        raise UserError(
            "no such front camera",
            file=capture.root,
            place="front",
            expected=f"one of {shorten(names, 100)}",
            found=front,
            remedy="correct `front` of this subject in params.yaml",
        )
    camera = cameras[names.index(front)]
    return centre, orientation(-camera.forward, -camera.rotation[1]), []


def normalizing_similarity(
    capture: Capture, front: str | None, given: Sequence[float] | None = None
) -> tuple[Similarity, list[Fact]]:
    """Capture -> normalised coordinates, and facts on what was guessed.

    Subject at the origin, facing +x, up +z; the median distance of the cameras from it is 1. With a tracked mesh,
    centre and orientation are the head's. Without, the centre is the point nearest to all optical axes, and the subject
    faces against the viewing direction of the camera `front`, whose image is upright.

    Args:
        given: (3,) the centre in the capture's coordinates, instead of either.
    """
    notes: list[Fact] = []
    if capture.tracking is not None:
        centre, rotation = _from_tracking(capture.tracking)
    else:
        centre, rotation, notes = _from_cameras(capture, front)
    if given is not None:
        centre = np.array(given, float)
    distance = float(np.median([np.linalg.norm(view.camera.centre - centre) for view in capture.views]))
    if not np.isfinite(distance) or distance < 1e-9:
        raise UserError(
            "the cameras stand in the subject's centre",
            file=capture.root,
            expected="cameras around the subject",
            found=f"median distance {distance}",
            remedy="check the camera poses; cameras must look at one subject from different places",
        )
    return Similarity(1 / distance, rotation, -(rotation @ centre) / distance), notes


def view_angles(cameras: Sequence[Camera]) -> Array:
    """(C, 2) elevation and azimuth of normalised cameras as the subject sees them, degrees; azimuth in -180..180."""
    centres = np.array([camera.centre for camera in cameras])
    elevation = np.arcsin(np.clip(centres[:, 2] / np.linalg.norm(centres, axis=1), -1, 1))
    return np.asarray(np.degrees(np.stack([elevation, np.arctan2(centres[:, 1], centres[:, 0])], -1)))


def cull(cameras: Sequence[Camera], params: NormalizeParams, file: Path | str) -> tuple[list[int], list[Fact]]:
    """Indices of the normalised cameras within `max_elevation` and `max_azimuth`, and a fact on each other one."""
    angles = view_angles(cameras)
    inside = (np.abs(angles[:, 0]) <= params.max_elevation) & (np.abs(angles[:, 1]) <= params.max_azimuth)
    facts = [
        fact("culled", camera=camera.name, elevation=float(elevation), azimuth=float(azimuth))
        for camera, (elevation, azimuth), used in zip(cameras, angles, inside, strict=True)
        if not used
    ]
    if not inside.any():
        each = [f"{c.name} ({e:.0f}, {a:.0f})" for c, (e, a) in zip(cameras, angles, strict=True)]
        raise UserError(
            "all cameras are culled",
            file=file,
            expected=f"elevations up to {params.max_elevation:g} and azimuths up to {params.max_azimuth:g} degrees",
            found=f"(elevation, azimuth) of {shorten(each)}",
            remedy="check `front`, or raise `max_elevation` and `max_azimuth` of `normalize` for this subject",
        )
    return [int(i) for i in np.flatnonzero(inside)], facts


def split_cameras(
    names: Sequence[str], subject: Subject, unused: Sequence[Fact], file: Path | str
) -> tuple[Split, ...]:
    """ "train", "validate" or "holdout" for each of the cameras that are used, in their order.

    `every: n` takes the cameras at positions p (from 0) with (p + 1) % n == 0: of all of them for `holdout`, of those
    that are not held out for `validate`.

    Args:
        unused: facts on cameras that were left out, to say why one that is named is not there.
    """

    def chosen(key: str, choice: Sequence[str] | HoldoutEvery, of: Sequence[str]) -> set[str]:
        """The cameras that a key of the subject chooses: by their names, or every n-th one of some."""
        if isinstance(choice, HoldoutEvery):
            return {name for p, name in enumerate(of) if (p + 1) % choice.every == 0}
        for name in sorted(set(choice) - set(names)):
            reasons = [str(one) for one in unused if one.camera == name]
            raise UserError(
                "a held-out camera is not there" if key == "holdout" else "a camera for validation is not there",
                file=file,
                place=key,
                expected=f"some of {shorten(names, 200)}",
                found=reasons[0] if reasons else f"{name}, which the capture does not have",
                remedy=f"correct `{key}` of this subject in params.yaml",
            )
        return set(choice)

    held = chosen("holdout", subject.holdout, names)
    if isinstance(subject.holdout, HoldoutEvery) and not held:
        every, culled = subject.holdout.every, sum(one.kind == "culled" for one in unused)
        more = f"; {culled} more were culled by elevation and azimuth (`normalize`)" if culled else ""
        raise UserError(
            "too few cameras to hold one out",
            file=file,
            place="holdout",
            expected=f"at least {every} cameras for `holdout: {{every: {every}}}`",
            found=f"{len(names)}: {shorten(names)}{more}",
            remedy=f"name one or two in `holdout` of this subject, such as ['{names[len(names) // 2]}']; with "
            "`holdout: []` all are trained on, and `evaluate` has nothing to score",
        )
    rest = [name for name in names if name not in held]
    validating = chosen("validate", subject.validation or (), rest)
    if both := sorted(held & validating):
        raise UserError(
            "a camera is held out and for validation, too",
            file=file,
            place="validate",
            expected=f"some of {shorten(rest, 200)}",
            found=shorten(both),
            remedy="correct `validate` or `holdout` of this subject in params.yaml",
        )
    if held | validating == set(names):
        raise UserError(
            "no camera is left for training",
            file=file,
            place="validate" if validating else "holdout",
            expected=f"fewer than {len(names)} cameras that are set aside",
            found=shorten(sorted(held | validating)),
            remedy="hold out fewer cameras",
        )
    return tuple("holdout" if name in held else "validate" if name in validating else "train" for name in names)
