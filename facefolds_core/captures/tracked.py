"""Multiface's tracked mesh: FRAME.obj, FRAME.bin, FRAME_transform.txt.

`.bin` holds float32 (V, 3) in the head frame (y up, face to +z), little-endian; `.obj` has the same vertices in text
and the faces; the transform is 3 x 4, head -> world, X_w = R X + t.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import Tracking
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.files.reading import check_folder, is_there, read_bytes, read_text
from facefolds_core.geometry.cameras import HUGE, Array, is_rotation
from facefolds_core.system.spill import spilled

_REMEDY = "copy the file again from the dataset, or choose other frames for this subject in params.yaml"
_wrong = partial(UserError, remedy=_REMEDY)


def read_obj(path: Path) -> tuple[Array, NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (F, 3) of a Wavefront file; polygons become fans, everything else is skipped."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    number = 0
    try:
        for line in read_text(path, _REMEDY, expected="a Wavefront mesh").splitlines():
            number += 1
            words = line.split()
            if words and words[0] == "v":
                vertices.append([float(word) for word in (words[1], words[2], words[3])])
            elif words and words[0] == "f":
                corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
                faces += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    except (ValueError, IndexError, OverflowError) as error:
        expected = "`v x y z` or `f a b c`"
        raise _wrong("garbled mesh", file=path, place=f"line {number}", expected=expected, found=str(error)) from None
    points, triangles = np.array(vertices, float).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)
    sound = min(len(points), len(triangles)) > 0 and bool((np.abs(points) <= HUGE).all())
    if not sound or triangles.min() < 0 or triangles.max() >= len(points):
        found = f"{len(points)} vertices, {len(triangles)} triangles"
        if len(triangles):
            found += f", vertex numbers {triangles.min() + 1} to {triangles.max() + 1}"
        raise _wrong("garbled mesh", file=path, expected="finite vertices, and faces that name them", found=found)
    return points, triangles.astype(np.int32)


def read_bin(path: Path, count: int | None) -> Array:
    """(V, 3) vertices of a .bin file.

    Args:
        count: V where it is known.
    """
    data = read_bytes(path, _REMEDY)
    if not data or len(data) % 12 or (count is not None and len(data) != 12 * count):
        expected = "a multiple of 12 bytes" if count is None else f"{12 * count} bytes ({count} vertices of 12)"
        raise _wrong("the tracked mesh has a wrong length", file=path, expected=expected, found=f"{len(data)} bytes")
    points = np.frombuffer(data, "<f4").reshape(-1, 3).astype(float)
    zeros = int((points == 0).all(1).sum())
    if zeros > 1:
        found = f"{zeros} of {len(points)} exactly at 0 0 0, as after an interrupted copy"
        raise _wrong("a damaged tracked mesh", file=path, expected="vertices in different places", found=found)
    return points


def parse_pose(text: str, path: Path) -> Array:
    """(3, 4) head -> world, from the text of a pose: finite, and R a rotation to 1e-3."""
    try:
        pose = np.array([[float(w) for w in line.split()] for line in text.splitlines() if line.strip()])
    except ValueError:
        pose = np.zeros(0)
    if pose.shape != (3, 4):
        raise _wrong("garbled head pose", file=path, expected="3 rows of 4 numbers", found=repr(text[:60]))
    if not (np.abs(pose) <= HUGE).all():
        message = f"the head pose has numbers that are {'beyond sense' if np.isfinite(pose).all() else 'not finite'}"
        expected = f"3 rows of 4 finite numbers, none above {HUGE:g}"
        raise _wrong(message, file=path, expected=expected, found=pose.tolist())
    R = pose[:, :3]
    if not is_rotation(R):
        expected, found = "R R^T = I and det R = 1", f"det R = {np.linalg.det(R):.6g}"
        raise _wrong("R of a head pose is not a rotation", file=path, expected=expected, found=found)
    return pose


def check_extent(points: Array, file: Path) -> None:
    """Refuse vertices (V, 3) that all lie in one point or on one line."""
    spread = np.linalg.svd(points - points.mean(0), compute_uv=False)
    if len(points) < 3 or spread[1] <= 1e-4 * spread[0] or spread[0] <= 1e-12:
        message = "the vertices of the tracked mesh lie in one point or on one line"
        found = f"{len(points)} vertices from {points.min(0).tolist()} to {points.max(0).tolist()}"
        raise _wrong(message, file=file, expected="the shape of a head", found=found)


def read_tracking(folder: Path, frames: list[str]) -> tuple[Tracking | None, list[str], list[Fact]]:
    """The tracked mesh of all frames that have one.

    Args:
        folder: tracked_mesh/SEGMENT.
        frames: names of frames.

    Returns:
        tracking (None where no frame has any), the frames that it covers (all where None), facts on those left out.
    """

    check_folder(folder, _REMEDY)
    poses = {name: folder / f"{name}_transform.txt" for name in frames}
    meshes = {
        name: [path for path in (folder / f"{name}.bin", folder / f"{name}.obj") if is_there(path)] for name in frames
    }
    tracked = [name for name in frames if is_there(poses[name]) and meshes[name]]
    if not tracked:
        return None, frames, [fact("no_mesh", folder=str(folder))]
    left_out = [fact("frame_without_mesh", frame=name) for name in frames if name not in tracked]
    topology = next((meshes[name][-1] for name in tracked if meshes[name][-1].suffix == ".obj"), None)
    faces, count = None, None
    if topology is None:
        left_out.append(fact("mesh_without_faces", folder=str(folder)))
    else:
        points, faces = read_obj(topology)
        count = len(points)
    vertices, moves = np.empty((0, 0, 3)), []
    for position, name in enumerate(tracked):
        file = meshes[name][0]
        points = read_bin(file, count) if file.suffix == ".bin" else read_obj(file)[0]
        count = count or len(points)
        sound = (np.abs(points) <= HUGE).all(1)
        if len(points) != count or not sound.all():
            found = f"{len(points)} vertices, {int((~sound).sum())} of them not finite or above {HUGE:g}"
            raise _wrong("a damaged tracked mesh", file=file, expected=f"{count} finite vertices", found=found)
        check_extent(points, file)
        if position == 0:
            vertices = spilled((len(tracked), count, 3))
        vertices[position] = points
        moves.append(parse_pose(read_text(poses[name], _REMEDY, expected="a head pose"), poses[name]))
    return Tracking(np.array(moves), vertices, faces), tracked, left_out
