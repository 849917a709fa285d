"""Whether the cameras of a normalised capture see its subject: nonsense in the calibration shows here.

A calibration can be well formed and still be wrong: matrices inverted, metres beside millimetres, a camera of another
rig. Then some camera looks past the head, and training would fit what is not there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.facts import shorten
from facefolds_core.geometry.cameras import Array, Camera

NEAR, FAR = 0.02, 50.0
"""Distances of a camera from the centre; the median camera's is 1."""
FOCAL = (0.1, 200.0)
"""Focal lengths over the long side of the picture: angles of view of 157 to 0.3 degrees."""
SMALL, LARGE = 0.01, 5.0
"""Diagonals of the tracked mesh's bounding box, in the same units; a head's is about 0.3."""
RADIUS = 0.25
"""Of the ball about the centre that stands for the head where there is no mesh."""
SAMPLES = 256
"""Vertices of the mesh that are looked at; one of them in the picture is enough."""
_CALIBRATION = "mend the calibration of these cameras, or take them out of the capture"


def check_sight(
    cameras: Sequence[Camera],
    frame_ids: Sequence[str],
    vertices: NDArray[np.floating] | None,
    file: Path | str,
) -> None:
    """Refuse cameras that do not see the subject at all; a close-up that shows a part of it is fine.

    Args:
        cameras: C, normalised.
        frame_ids: K names of frames.
        vertices: (K, V, 3) of the tracked mesh, normalised, or None.
        file: the capture, for the message.
    """
    wrong = partial(UserError, file=file, remedy=_CALIBRATION)
    _check_rig(cameras, wrong)
    if vertices is None:
        around = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], float)
        ball = RADIUS * around / np.linalg.norm(around, axis=1, keepdims=True)
        points = np.broadcast_to(np.concatenate([np.zeros((1, 3)), ball]), (len(frame_ids), 27, 3))
        what = f"the centre, or {RADIUS} units around it"
    else:
        _check_size(vertices, frame_ids, wrong)
        points = np.asarray(vertices[:, :: max(1, vertices.shape[1] // SAMPLES)], float)
        what = "the tracked mesh"
    views = [in_picture(camera, points) for camera in cameras]
    blind = [camera.name for camera, view in zip(cameras, views, strict=True) if not view.any()]
    if blind:
        every = len(blind) == len(cameras)
        raise wrong(
            "no camera sees the subject" if every else "cameras that look past the subject",
            place=f"camera{'s' if len(blind) > 1 else ''} {shorten(blind)}",
            expected=f"{what} in front of each camera and in its picture",
            found="nothing of it" + ("; are the matrices inverted, or the axes others?" if every else ""),
        )
    lost = set(range(len(frame_ids)))
    for view in views:
        lost -= {frame for frame, visible in enumerate(view) if visible.any()}
    if lost:
        raise wrong(
            "the tracked mesh lies in no camera's picture",
            place=f"frame {shorten([frame_ids[f] for f in sorted(lost)])}",
            remedy="copy the head poses of these frames again, or choose other frames for this subject in params.yaml",
        )


def in_picture(camera: Camera, points: Array) -> NDArray[np.bool_]:
    """For points (..., 3): whether they lie in front of the camera and in its picture (...)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        pixels, depth = camera.project(points)
        inside = (pixels >= 0) & (pixels <= [camera.width, camera.height])
    return np.asarray(inside.all(-1) & (depth > 0))


def _check_rig(cameras: Sequence[Camera], wrong: Callable[..., UserError]) -> None:
    focal = {f"{c.name} ({c.K[0, 0]:.4g} pixels)": c.K[0, 0] / max(c.width, c.height) for c in cameras}
    if odd := [words for words, value in focal.items() if not FOCAL[0] <= value <= FOCAL[1]]:
        expected = f"{FOCAL[0]} to {FOCAL[1]:g} times the picture's long side"
        raise wrong("focal lengths that no camera has", place=f"camera {shorten(odd)}", expected=expected)
    centres = np.array([camera.centre for camera in cameras])
    away = {f"{c.name} ({np.linalg.norm(c.centre):.3g})": np.linalg.norm(c.centre) for c in cameras}
    if odd := [words for words, value in away.items() if not NEAR <= value <= FAR]:
        message, expected = "cameras absurdly near to the subject, or far from it", "times the median camera's distance"
        raise wrong(message, place=f"camera {shorten(odd)}", expected=f"{NEAR} to {FAR:g} {expected}")
    if len(centres) > 1 and np.linalg.norm(centres - centres[0], axis=1).max() < 1e-3:
        raise wrong(
            "all cameras stand in one place",
            expected="cameras around the subject",
            found=f"{len(centres)} cameras less than a thousandth of their distance from the subject apart",
            remedy="check the camera poses; cameras must look at one subject from different places",
        )


def _check_size(vertices: NDArray[np.floating], frame_ids: Sequence[str], wrong: Callable[..., UserError]) -> None:
    sizes = np.linalg.norm(vertices.max(1) - vertices.min(1), axis=1)
    odd = ~((sizes >= SMALL) & (sizes <= LARGE))
    if odd.any():
        frame = int(np.flatnonzero(odd)[0])
        raise wrong(
            "the tracked mesh is absurdly small or large",
            place=f"frame {frame_ids[frame]}",
            expected=f"{SMALL} to {LARGE:g} times the median camera's distance across",
            found=f"{sizes[frame]:.3g} times",
            remedy="check the units: cameras, meshes and head poses must all be in the same ones",
        )
