"""ava-256: the actor filmed into it with its tracked mesh, an example by hand, damaged archives."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.actor import frame_times, head_pose, tracked_mesh
from facefolds_core.captures.sources import ava256
from facefolds_core.errors import UserError
from facefolds_core.params import CaptureParams
from tests.captures.fixtures import encoded
from tests.filmed import Film, Reader, check_same, film, scene_of

read = Reader("ava256", segment="EXP_a")

WIDTH, HEIGHT = 43, 66  # as 2668 x 4096, to a few thousandths of a percent
FRAMES = ("000120", "000124", "000128")
MESHES = "kinematic_tracking/registration_vertices.zip"


def truth() -> Film:
    return film(width=WIDTH, height=HEIGHT)


def avif(image: np.ndarray) -> bytes:
    return encoded(image, "AVIF", quality=100, subsampling="4:4:4", speed=8)


def pack(path: Path, members: dict[str, bytes]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)


def entry(name: str, K: np.ndarray, w2c: np.ndarray, distortion: list[float]) -> dict[str, Any]:
    T = np.concatenate([w2c.T, [[0], [0], [0], [1]]], 1)
    return {"cameraId": name, "K": K.T.tolist(), "T": T.tolist(), "distortion": distortion}


def ply(vertices: np.ndarray, faces: np.ndarray | None = None) -> bytes:
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *(f"property float {a}" for a in "xyz")]
    if faces is not None:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    lines += ["end_header", *(" ".join(f"{x:.6f}" for x in v) for v in vertices)]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces] if faces is not None else []
    return ("\n".join(lines) + "\n").encode()


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root, actor = tmp_path_factory.mktemp("ava256"), truth()
    full = np.diag([2668 / WIDTH, 4096 / HEIGHT, 1.0])
    half = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    cameras = [entry(c.name, full @ c.K - half, c.w2c, [0.0] * 4) for c in actor.cameras]
    (root / "camera_calibration.json").write_text(json.dumps({"KRT": cameras}))
    rows = [f"EXP_a,{int(name)}" for name in FRAMES] + ["EXP_b,500"]
    (root / "frame_list.csv").write_text("seg_id,frame_id\n" + "\n".join(rows) + "\n")
    for c, name in enumerate(actor.names):
        members = {f"cam{name}/{frame}.avif": avif(actor.images[c, k]) for k, frame in enumerate(FRAMES)}
        pack(root / "image" / f"cam{name}.zip", members)
    poses, meshes = {}, {}
    for frame, time in zip(FRAMES, frame_times(CaptureParams(frames=3)), strict=True):
        rotation, translation = head_pose(float(time), 0.0)
        pose = np.concatenate([rotation, translation[:, None]], 1)
        poses[f"{frame}.txt"] = "\n".join(" ".join(map(repr, row)) for row in pose.tolist()).encode()
        mesh = tracked_mesh(float(time))
        meshes[f"{frame}.ply"] = ply(mesh.vertices, mesh.faces)
    pack(root / "head_pose" / "head_pose.zip", poses)
    pack(root / MESHES, meshes)
    return root


def test_the_filmed_actor_comes_back_with_its_mesh(filmed: Path, tmp_path: Path) -> None:
    scene = scene_of(filmed, "ava256", tmp_path / "scene", truth().names, segment="EXP_a", fps=30.0)
    check_same(scene, truth(), lossless=False)
    vertices, faces = scene.load_surface()
    mesh = tracked_mesh(float(frame_times(CaptureParams(frames=3))[1]))
    rotation, translation = head_pose(0.0, 0.0)
    expected = scene.from_capture.apply(mesh.vertices @ rotation.T + translation)
    assert np.abs(vertices[1] - expected).max() < 1e-5
    assert np.array_equal(faces, mesh.faces)


def test_frames_and_rate_are_those_of_the_list(filmed: Path) -> None:
    capture = read(filmed)
    assert (capture.frame_ids, capture.fps) == (FRAMES, 7.5)


def test_an_example_by_hand(copied: Path) -> None:
    # At (1, 2, 3), turned by a quarter about y so that it looks along x; the real file's kind of numbers.
    K = [[10000.0, 0.0, 0.0], [0.0, 10010.0, 0.0], [1333.5, 2047.5, 1.0]]
    T = [[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [3.0, -2.0, -1.0, 1.0]]
    camera = {"cameraId": "A000", "K": K, "T": T, "distortion": [-0.07, 0.04, -0.003, 0.003]}
    (copied / "camera_calibration.json").write_text(json.dumps({"KRT": [camera]}))
    (view,) = read(copied).views
    assert view.camera.centre == pytest.approx([1, 2, 3])
    assert view.camera.forward == pytest.approx([1, 0, 0])
    assert view.lens.coefficients.tolist() == [-0.07, 0.04, -0.003, 0.003, 0.0]
    expected = [[10000 * 43 / 2668, 0, 21.5], [0, 10010 * 66 / 4096, 33], [0, 0, 1]]
    np.testing.assert_allclose(view.lens.K, expected)


def test_a_mesh_without_faces_takes_them_from_the_topology(copied: Path) -> None:
    mesh = tracked_mesh(0.0)
    pack(copied / MESHES, {f"{frame}.ply": ply(mesh.vertices) for frame in FRAMES})
    assert read(copied).tracking.faces is None
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    (copied / "face_topology.obj").write_text("\n".join(lines) + "\n")
    assert np.array_equal(np.asarray(read(copied).tracking.faces), mesh.faces)


def test_without_tracking_there_is_none(copied: Path) -> None:
    shutil.rmtree(copied / "head_pose")
    capture = read(copied)
    assert capture.tracking is None and capture.frame_ids == FRAMES


def test_cameras_and_frames_that_are_missing_are_said(copied: Path) -> None:
    (copied / "image" / "camA001.zip").unlink()
    pack(copied / "image" / "camA002.zip", {"camA002/000120.avif": avif(truth().images[2, 0])})
    capture = read(copied)
    assert [view.name for view in capture.views] == ["A000", "A002", "A003", "A004"]
    assert "camera A001: calibrated, but has no pictures" in map(str, capture.left_out)
    assert [f for c, f in capture.images if c == 1] == [0]


@pytest.mark.parametrize(("segment", "words"), [(None, "several segments"), ("EXP_c", "no such segment")])
def test_the_segment_must_be_one(filmed: Path, segment: str | None, words: str) -> None:
    read.refused(filmed, words, "one of EXP_a, EXP_b", segment=segment)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda krt: krt.append(krt[0]), "a camera appears twice"),
        (lambda krt: krt.clear(), "no cameras"),
        (lambda krt: krt[1].pop("cameraId"), "no camera"),
        (lambda krt: krt[1].update(K=[[1, 2, 3]]), "a matrix of the wrong shape"),
        (lambda krt: krt[1].update(T=[["x"] * 4] * 4), "not a number"),
        (lambda krt: krt[1].update(distortion="strong"), "no distortion"),
    ],
)
def test_a_garbled_calibration(copied: Path, change: Callable[[list[dict[str, Any]]], Any], words: str) -> None:
    path = copied / "camera_calibration.json"
    value = json.loads(path.read_text())
    change(value["KRT"])
    path.write_text(json.dumps(value))
    read.refused(copied, words, path)


def test_a_garbled_list_of_frames(copied: Path) -> None:
    (copied / "frame_list.csv").write_text("seg_id,frame_id\nEXP_a,12\nEXP_a,x\n")
    read.refused(copied, "garbled list of frames", "line 3")


@pytest.mark.parametrize("member", ["image/camA002.zip", MESHES])
def test_an_archive_that_is_cut_off(copied: Path, member: str) -> None:
    path = copied / member
    path.write_bytes(path.read_bytes()[:-40])
    read.refused(copied, "a damaged zip archive", path)


def test_a_picture_that_is_cut_off(copied: Path, tmp_path: Path) -> None:
    whole = avif(truth().images[2, 1])
    members = {f"camA002/{frame}.avif": whole for frame in FRAMES}
    pack(copied / "image" / "camA002.zip", {**members, f"camA002/{FRAMES[1]}.avif": whole[: len(whole) // 2]})
    with pytest.raises(UserError, match="a damaged image") as caught:
        scene_of(copied, "ava256", tmp_path / "scene", truth().names, segment="EXP_a")
    assert caught.value.place == f"camera A002, frame {FRAMES[1]} (camA002/{FRAMES[1]}.avif)"


@pytest.mark.parametrize("content", [b"", b"no mesh", ply(np.zeros((9, 3)))])
def test_a_damaged_mesh(copied: Path, content: bytes) -> None:
    pack(copied / MESHES, {f"{frame}.ply": content for frame in FRAMES})
    read.refused(copied, "tracked mesh")


def test_it_is_recognised_from_the_folder_above(filmed: Path, tmp_path: Path) -> None:
    shutil.copytree(filmed, tmp_path / "decoder")
    found = ava256.recognise(tmp_path)
    assert found is not None and (found.path, found.keys) == (tmp_path / "decoder", {"segment": "EXP_a"})
    assert ava256.recognise(tmp_path / "decoder" / "image") is None
