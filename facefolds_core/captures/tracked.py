"""Multiface's tracked mesh: FRAME.obj, FRAME.bin, FRAME_transform.txt.

`.bin` holds float32 (V, 3) in the head frame (y up, face to +z), little-endian; `.obj` has the same vertices in text
and the faces; the transform is 3 x 4, head -> world, X_w = R X + t.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Tracking
from facefolds_core.errors import UserError

Array = NDArray[np.float64]
_REMEDY = "copy the file again from the dataset, or choose other frames for this subject in params.yaml"


def read_obj(path: Path) -> tuple[Array, NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (F, 3) of a Wavefront file; polygons become fans, everything else is skipped.

    Raises:
        UserError: if the file is not readable as such, or a face names a vertex that is not there; names the line.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    number = 0
    try:
        for line in path.read_text(encoding="utf-8").splitlines():
            number += 1
            words = line.split()
            if words and words[0] == "v":
                vertices.append([float(word) for word in (words[1], words[2], words[3])])
            elif words and words[0] == "f":
                corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
                faces += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    except (ValueError, IndexError) as error:
        raise UserError(
            "garbled mesh",
            file=path,
            place=None if isinstance(error, UnicodeDecodeError) else f"line {number}",
            expected="`v x y z` or `f a b c`",
            found=str(error),
            remedy=_REMEDY,
        ) from None
    points, triangles = np.array(vertices, float).reshape(-1, 3), np.array(faces, np.int32).reshape(-1, 3)
    if len(points) == 0 or (len(triangles) and (triangles.min() < 0 or triangles.max() >= len(points))):
        raise UserError(
            "garbled mesh",
            file=path,
            expected="vertices, and faces that name them",
            found=f"{len(points)} vertices, {len(triangles)} triangles"
            + (f", vertex numbers {triangles.min() + 1} to {triangles.max() + 1}" if len(triangles) else ""),
            remedy=_REMEDY,
        )
    return points, triangles


def read_bin(path: Path, count: int | None) -> Array:
    """(V, 3) vertices of a .bin file.

    Args:
        count: V where it is known.

    Raises:
        UserError: if the length of the file does not fit.
    """
    data = path.read_bytes()
    if not data or len(data) % 12 or (count is not None and len(data) != 12 * count):
        raise UserError(
            "the tracked mesh has a wrong length",
            file=path,
            expected="a multiple of 12 bytes" if count is None else f"{12 * count} bytes ({count} vertices of 12)",
            found=f"{len(data)} bytes",
            remedy=_REMEDY,
        )
    return np.frombuffer(data, "<f4").reshape(-1, 3).astype(float)


def read_pose(path: Path) -> Array:
    """(3, 4) head -> world.

    Raises:
        UserError: if the file is garbled, has numbers that are not finite, or R is not a rotation (to 1e-3).
    """
    try:
        pose = np.array([[float(w) for w in line.split()] for line in path.read_text().splitlines() if line.strip()])
    except (ValueError, UnicodeDecodeError):
        pose = np.zeros(0)
    if pose.shape != (3, 4):
        raise UserError(
            "garbled head pose", file=path, expected="3 rows of 4 numbers", found=_start(path), remedy=_REMEDY
        )
    if not np.isfinite(pose).all():
        raise UserError(
            "the head pose has numbers that are not finite",
            file=path,
            expected="3 rows of 4 finite numbers",
            found=pose.tolist(),
            remedy=_REMEDY,
        )
    R = pose[:, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > 1e-3 or np.linalg.det(R) < 0:
        raise UserError(
            "R of a head pose is not a rotation",
            file=path,
            expected="R R^T = I and det R = 1",
            found=f"det R = {np.linalg.det(R):.6g}",
            remedy=_REMEDY,
        )
    return pose


def _start(path: Path) -> str:
    return repr(path.read_bytes()[:60])


def read_tracking(folder: Path, frames: list[str]) -> tuple[Tracking | None, list[str], list[str]]:
    """The tracked mesh of all frames that have one.

    Args:
        folder: tracked_mesh/SEGMENT.
        frames: names of frames.

    Returns:
        tracking (None where no frame has any), the frames that it covers (all where None), lines on those left out.

    Raises:
        UserError: for a damaged file, or a mesh whose number of vertices changes.
    """

    def meshes(name: str) -> tuple[Path, Path, Path]:
        return folder / f"{name}.bin", folder / f"{name}.obj", folder / f"{name}_transform.txt"

    tracked = [n for n in frames if meshes(n)[2].exists() and (meshes(n)[0].exists() or meshes(n)[1].exists())]
    if not tracked:
        return (
            None,
            frames,
            [f"tracked mesh: none in {folder} with its _transform.txt; cameras give centre and orientation"],
        )
    left_out = [f"frame {name}: no tracked mesh or no head pose" for name in frames if name not in tracked]
    topology = next((meshes(name)[1] for name in tracked if meshes(name)[1].exists()), None)
    faces, count = None, None
    if topology is None:
        left_out.append(f"tracked mesh: {folder} has no .obj, so no faces; it gives centre and orientation only")
    else:
        points, faces = read_obj(topology)
        count = len(points)
    vertices, poses = [], []
    for name in tracked:
        binary, text, transform = meshes(name)
        points = read_bin(binary, count) if binary.exists() else read_obj(text)[0]
        file = binary if binary.exists() else text
        count = count or len(points)
        if len(points) != count or not np.isfinite(points).all():
            found = f"{len(points)} vertices, {int((~np.isfinite(points)).any(1).sum())} of them not finite"
            raise UserError(
                "a damaged tracked mesh", file=file, expected=f"{count} finite vertices", found=found, remedy=_REMEDY
            )
        vertices.append(points)
        poses.append(read_pose(transform))
    return Tracking(np.array(poses), np.array(vertices), faces), tracked, left_out
