"""The actor as a capture on disk: layout, calibration, tracked mesh, stage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.actor import SEGMENT, make_rig, render, tracked_mesh, write_capture
from facefolds_core.captures.actor.motion import pose_at
from facefolds_core.captures.actor.shape import distance
from facefolds_core.captures.tracked import read_obj
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import read_json, write_json
from facefolds_core.params import CaptureParams
from facefolds_core.pipeline.capture import capture as run_stage
from tests.filmed import Reader

PARAMS = CaptureParams(cameras=3, frames=2, height=48, width=32, plates=False)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("actor") / "capture"
    write_capture(folder, PARAMS)
    return folder


def test_all_files_are_there(written: Path) -> None:
    files = {str(p.relative_to(written)) for p in written.rglob("*") if p.is_file()}
    files -= {f"audio/{SEGMENT}.wav"}  # where espeak-ng is installed
    expected = {"KRT", "frame_list.txt"}
    for frame in ("000001", "000002"):
        expected |= {f"tracked_mesh/{SEGMENT}/{frame}{end}" for end in (".obj", ".bin", "_transform.txt")}
        for camera in ("A000", "A001", "A002"):
            expected |= {f"{kind}/{SEGMENT}/{camera}/{frame}.png" for kind in ("images", "masks")}
    assert files == expected
    assert (written / "frame_list.txt").read_text().split("\n") == [f"{SEGMENT} 000001", f"{SEGMENT} 000002", ""]


def test_what_was_filmed_is_read_back(written: Path) -> None:
    """Cameras (KRT counts pixels from their centres), pictures, and the tracked mesh, which projects into the masks."""
    capture, rig = Reader("multiface")(written), make_rig(PARAMS).cameras
    picture = render(rig[1], 0.5 * PARAMS.seconds)
    np.testing.assert_array_equal(capture.images[1, 1].rgb(""), picture.rgb)
    np.testing.assert_array_equal(capture.masks[1, 1].opacity("")[..., 0], np.rint(255 * picture.opacity))
    vertices = capture.tracking.vertices[1]
    np.testing.assert_allclose(read_obj(written / f"tracked_mesh/{SEGMENT}/000002.obj")[0], vertices, atol=1e-4)
    np.testing.assert_allclose(vertices, tracked_mesh(0.5 * PARAMS.seconds).vertices, atol=1e-4)
    for c, (view, camera) in enumerate(zip(capture.views, rig, strict=True)):
        np.testing.assert_allclose(view.camera.K, camera.K, atol=1e-5)
        np.testing.assert_allclose(view.camera.w2c, camera.w2c, atol=1e-6)
        column, row = np.floor(camera.project(capture.tracking.world_vertices()[0])[0]).astype(int).T
        inside = (column >= 0) & (column < PARAMS.width) & (row >= 0) & (row < PARAMS.height)
        assert inside.mean() > 0.9
        assert np.mean(capture.masks[c, 0].opacity("")[row[inside], column[inside]] > 128) > 0.98


def test_an_interrupted_capture_leaves_nothing(tmp_path: Path) -> None:
    def stop() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_capture(tmp_path / "capture", PARAMS, stop)
    assert list(tmp_path.iterdir()) == []


def test_mesh_lies_on_the_surface() -> None:
    distances = [distance(*map(float, vertex), pose_at(0.5)) for vertex in tracked_mesh(0.5).vertices[::7]]
    assert np.abs(distances).max() < 0.1


def test_mesh_keeps_its_topology_and_moves() -> None:
    a, b = tracked_mesh(0.0), tracked_mesh(0.5)
    assert np.array_equal(a.faces, b.faces)
    assert np.array_equal(a.uv, b.uv)
    moved = np.linalg.norm(a.vertices - b.vertices, axis=1)
    chin = (np.abs(a.vertices[:, 0]) < 15) & (a.vertices[:, 1] < -95) & (a.vertices[:, 2] > 60)
    skull = a.vertices[:, 1] > 60
    assert moved[chin].max() > 3
    assert moved[skull].max() < 1e-3


def test_mesh_faces_outwards() -> None:
    mesh = tracked_mesh(0.0)
    corners = mesh.vertices[mesh.faces].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = corners.mean(1) - [0.0, -20.0, -15.0]
    assert np.mean((normals * outward).sum(1) > 0) > 0.98


def view(camera_index: int, cameras: int = 24) -> tuple[float, float, float]:
    """Azimuth and elevation in degrees, and distance in mm, of a rig's camera as seen from the head."""
    camera = make_rig(CaptureParams(cameras=cameras)).cameras[camera_index]
    x, y, z = np.diag([1.0, -1.0, -1.0]) @ (camera.centre - [0, 0, 1000])
    return np.degrees(np.arctan2(x, z)), np.degrees(np.arctan2(y, np.hypot(x, z))), float(np.linalg.norm([x, y, z]))


def test_held_out_places_are_inner_views() -> None:
    assert 15 <= abs(view(11)[0]) <= 20
    assert 35 <= abs(view(23)[0]) <= 45
    assert all(0 < view(k)[1] < 15 for k in (11, 23))


@pytest.mark.parametrize("cameras", [3, 24, 60])
def test_rig_covers_the_front(cameras: int) -> None:
    views = np.array([view(k, cameras) for k in range(cameras)])
    assert np.abs(views[:, 0]).max() <= 76
    assert -27 <= views[:, 1].min() <= views[:, 1].max() <= 37
    assert np.all(np.abs(views[:, 2] - 1000) < 20)


def configured(data: Path, source: str, path: Path) -> SubjectFolders:
    folders = SubjectFolders(data / "anyone")
    write_json(folders.config / "entry.json", {"source": source, "path": str(path)})
    write_json(folders.config / "capture.json", PARAMS.model_dump(mode="json"))
    return folders


def test_stage_generates_the_actor(tmp_path: Path) -> None:
    folders = configured(tmp_path / "data", "actor", tmp_path)
    assert "6 pictures" in run_stage(folders)
    assert read_json(folders.capture / "source.json") == {"source": "actor", "path": str(tmp_path)}
    assert (folders.capture / "KRT").is_file()


def test_stage_notes_where_another_capture_is_and_refuses_one_that_is_not_there(tmp_path: Path) -> None:
    folders = configured(tmp_path / "data", "multiface", tmp_path / "elsewhere")
    with pytest.raises(UserError, match="elsewhere"):
        run_stage(folders)
    assert not folders.capture.exists()
    (tmp_path / "elsewhere").mkdir()
    run_stage(folders)
    assert [p.name for p in folders.capture.iterdir()] == ["source.json"]
