"""ava-256 (Martinez et al. 2024): the dome's capture of one subject.

    camera_calibration.json                     KRT: a list of cameraId, K and T transposed, distortion
    frame_list.csv                              seg_id, frame_id
    image/camCAMERA.zip                         camCAMERA/FRAME.avif
    head_pose/head_pose.zip                     FRAME.txt, 3 x 4, head to world
    kinematic_tracking/registration_vertices.zip    FRAME.ply, vertices in the head's frame
    face_topology.obj                           not in the download: the mesh's faces; copy it from the code's assets/

World to camera, OpenCV's axes, millimetres: [R | t] is T[:4, :3] transposed. K and the distortion k1, k2, p1, p2 are
for 2668 x 4096; releases have pictures a half or a quarter as large. FRAME has six digits. Read from
facebookresearch/ava-256: data/ava_dataset.py, data/utils.py, utils.py (load_camera_calibration), download.py (names of
files) and DATASHEET.md (sizes, 30 pictures a second; the smaller releases keep some of the frames).
"""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from trimesh.exchange.ply import load_ply

from facefolds_core.captures.capture import Capture, Tracking
from facefolds_core.captures.gathering import Calibration, Recognised, chosen_segment, gather, inside
from facefolds_core.captures.numbers import is_number, matrix_from, short
from facefolds_core.captures.picture import Picture, ZipPicture, open_zip, read_member
from facefolds_core.captures.tracked import check_extent, parse_pose, read_obj
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact, shorten
from facefolds_core.files.reading import check_folder, check_regular, is_regular, read_text
from facefolds_core.files.writing import read_json
from facefolds_core.geometry.cameras import HUGE, Array
from facefolds_core.params import Subject

FULL_SIZE = (2668, 4096)
FPS = 30.0
PIXEL_CENTRES = 0.0
"""OpenCV's calibration, as Multiface's, whose successor this is."""
POSES, VERTICES = "head_pose/head_pose.zip", "kinematic_tracking/registration_vertices.zip"
FORMATS = ("AVIF", "PNG", "JPEG")
_REMEDY = "copy the file again from the dataset"
_wrong = partial(UserError, remedy=_REMEDY)
_MISSING = "point `path` at the folder that holds camera_calibration.json and image/"


def recognise(root: Path) -> Recognised | None:
    """The folder of a decoder's data, or the subject's above it."""
    for folder in (root, root / "decoder"):
        if is_regular(folder / "camera_calibration.json") and _archives(folder):
            segments = sorted(_listed(folder)) if is_regular(folder / "frame_list.csv") else []
            keys = {"segment": segments[0]} if len(segments) > 1 else {}
            return Recognised(f"a subject of ava-256, segments {shorten(segments)}", folder, keys)
    return None


def read(root: Path, subject: Subject) -> Capture:
    """Of the folder with camera_calibration.json; `segment` of the subject is a seg_id of frame_list.csv."""
    check_folder(root, _MISSING)
    calibrations = _calibrations(root / "camera_calibration.json")
    segments = _listed(root)
    chosen = chosen_segment(segments, subject.segment, root / "frame_list.csv", _REMEDY)
    frames = sorted(set(segments[chosen]))
    poses, meshes = _members(root / POSES), _members(root / VERTICES)
    left_out: list[Fact] = []
    if poses and meshes:
        left_out += [fact("frame_without_mesh", frame=name) for name in frames if name not in poses.keys() & meshes]
        frames = [name for name in frames if name in poses and name in meshes]
    else:
        left_out.append(fact("no_mesh", folder=str(root / "kinematic_tracking")))
    photos: dict[str, dict[str, Picture]] = {}
    for camera, archive in _archives(root).items():
        members = _members(archive)
        photos[camera] = {name: ZipPicture(archive, members[name], FORMATS) for name in frames if name in members}
    steps = np.diff([int(name) for name in frames])
    fps = FPS / float(np.median(steps)) if len(steps) else FPS
    capture = gather(root, calibrations, photos, subject, fps=fps, pixel_centres=PIXEL_CENTRES, left_out=left_out)
    if not (poses and meshes):
        return capture
    tracking, facts = _tracking(root, capture.frame_ids, poses, meshes)
    return replace(capture, tracking=tracking, left_out=(*capture.left_out, *facts))


def _archives(root: Path) -> dict[str, Path]:
    """Camera -> archive of its pictures."""
    files = [path for path in inside(root / "image") if path.suffix == ".zip" and path.stem.startswith("cam")]
    return {path.stem.removeprefix("cam"): path for path in files}


def _members(archive: Path) -> dict[str, str]:
    """Frame -> member of an archive; none where there is no archive."""
    if not is_regular(archive):
        return {}
    names = [PurePosixPath(name) for name in open_zip(archive).namelist()]
    return {f"{int(name.stem):06d}": str(name) for name in names if name.stem.isdecimal() and len(name.stem) < 12}


def _calibrations(path: Path) -> list[Calibration]:
    check_regular(path, _MISSING)
    value = read_json(path, remedy=_REMEDY)
    entries = value.get("KRT") if isinstance(value, dict) else None
    if not isinstance(entries, list) or not entries:
        raise _wrong("no cameras", file=path, place="KRT", expected="a list", found=short(entries))
    return [_calibration(entry, path, f"KRT[{i}]") for i, entry in enumerate(entries)]


def _calibration(entry: Any, path: Path, place: str) -> Calibration:
    name = entry.get("cameraId") if isinstance(entry, dict) else None
    if not isinstance(name, str) or not name:
        expected = "an object with cameraId, K, T, distortion"
        raise _wrong("no camera", file=path, place=place, expected=expected, found=short(entry))
    place = f"{place} (camera {name})"
    K = matrix_from(entry.get("K"), ((3, 3),), path, f"{place}, K", _REMEDY).T
    w2c = matrix_from(entry.get("T"), ((4, 4), (4, 3)), path, f"{place}, T", _REMEDY)[:4, :3].T
    bent = entry.get("distortion", [])
    if not isinstance(bent, list) or len(bent) > 5 or not all(is_number(b) and abs(b) <= HUGE for b in bent):
        where = f"{place}, distortion"
        raise _wrong("no distortion", file=path, place=where, expected="k1, k2, p1, p2", found=short(bent))
    return Calibration(name, K, w2c, path, place, np.array(bent, float), size=FULL_SIZE)


def _listed(root: Path) -> dict[str, list[str]]:
    """Segment -> its frames, of frame_list.csv."""
    path = root / "frame_list.csv"
    text = read_text(path, _REMEDY, expected="frame_list.csv")
    rows = list(csv.DictReader(io.StringIO(text), skipinitialspace=True))
    segments: dict[str, list[str]] = {}
    for line, row in enumerate(rows, 2):
        segment, frame = row.get("seg_id"), row.get("frame_id") or ""
        if segment is None or not frame.isdecimal() or len(frame) > 11:
            found = short({key: row[key] for key in list(row)[:4]}) if not row else ", ".join(map(str, row.values()))
            expected = "columns seg_id and frame_id, a number"
            raise _wrong("garbled list of frames", file=path, place=f"line {line}", expected=expected, found=found)
        segments.setdefault(segment, []).append(f"{int(frame):06d}")
    if not segments:
        raise _wrong("an empty list of frames", file=path, expected="seg_id,frame_id")
    return segments


def _tracking(
    root: Path, frames: tuple[str, ...], poses: dict[str, str], meshes: dict[str, str]
) -> tuple[Tracking, list[Fact]]:
    """Of these frames, and a note where the mesh has no faces."""
    archive, vertices_file = root / POSES, root / VERTICES
    moved: list[Array] = []
    vertices: list[Array] = []
    faces: Any = None
    for name in frames:
        text = read_member(archive, poses[name]).decode("utf-8", "replace")
        moved.append(parse_pose(text, archive / poses[name]))
        points, triangles = _mesh(vertices_file, meshes[name])
        if vertices and len(points) != len(vertices[0]):
            raise _damaged(vertices_file / meshes[name], f"{len(vertices[0])} vertices, as before", f"{len(points)}")
        vertices.append(points)
        faces = triangles if faces is None else faces
    if faces is None and is_regular(root / "face_topology.obj"):
        faces = read_obj(root / "face_topology.obj")[1]
    if faces is not None and faces.max() >= len(vertices[0]):
        found = f"faces of a mesh with {faces.max() + 1} vertices"
        raise _damaged(root / "face_topology.obj", f"faces of a mesh with {len(vertices[0])} vertices", found)
    notes = [] if faces is not None else [fact("mesh_without_faces", folder=str(vertices_file.parent))]
    return Tracking(np.array(moved), np.array(vertices), faces), notes


def _mesh(archive: Path, member: str) -> tuple[Array, Any]:
    """(V, 3) vertices, and (F, 3) faces or None, of a PLY."""
    try:
        value = load_ply(io.BytesIO(read_member(archive, member)))
        points = np.asarray(value["vertices"], np.float64)
        faces = np.asarray(value["faces"], np.int32) if len(value.get("faces", ())) else None
    except UserError:
        raise
    except Exception as error:  # trimesh raises what its parsing happens to raise
        raise _damaged(archive / member, "a mesh in PLY", str(error)[:200]) from None
    if points.ndim != 2 or points.shape[1] != 3 or not (np.abs(points) <= HUGE).all():
        raise _damaged(archive / member, "finite vertices", f"{points.shape}")
    check_extent(points, archive / member)
    return points, faces


def _damaged(file: Path, expected: str, found: str) -> UserError:
    return _wrong("a damaged tracked mesh", file=file, expected=expected, found=found)
