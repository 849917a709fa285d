"""The Multiface reader: calibration, image size, missing things, tracked meshes."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.picture import FilePicture
from facefolds_core.captures.sources.multiface import read_krt
from facefolds_core.captures.tracked import read_obj
from facefolds_core.params import FrameRange
from tests.captures.fixtures import (
    FACES,
    HEAD,
    HEAD_TO_WORLD,
    SEGMENT,
    VERTICES,
    krt_text,
    pattern,
    save,
    write_multiface,
)
from tests.filmed import Reader

read = Reader("multiface")
POINTS = HEAD + np.random.default_rng(0).uniform(-100, 100, (40, 3))


@pytest.mark.parametrize(
    ("scale", "pixel_centres", "keys"),
    [
        (1.0, 0.0, {}),
        (1.0, 0.5, {"pixel_centres": 0.5}),
        (32.0, 0.0, {}),  # full size: 2048 high for images of 64
        (3.0, 0.0, {"krt_size": (120, 192)}),
    ],
)
def test_projection_in_continuous_coordinates(
    tmp_path: Path, scale: float, pixel_centres: float, keys: dict[str, Any]
) -> None:
    made = write_multiface(tmp_path)
    made.krt.write_text(krt_text(made.cameras, scale, pixel_centres))
    for camera, view in zip(made.cameras, read(tmp_path, **keys).views, strict=True):
        found = view.camera.project(POINTS)[0]
        if scale == 32.0:  # KRT is for 1334 x 2048, of which 40 x 64 is not quite the same shape
            found[:, 0] *= 1334 / 1280
        assert np.abs(found - camera.project(POINTS)[0]).max() < 1e-3


@pytest.mark.parametrize(("scale", "words"), [(1.0, "already scaled"), (32.0, "full-size")])
def test_it_says_what_it_found_out_about_the_calibration(tmp_path: Path, scale: float, words: str) -> None:
    made = write_multiface(tmp_path)
    made.krt.write_text(krt_text(made.cameras, scale))
    (note,) = read(tmp_path).left_out
    assert words in str(note)
    assert "krt_size" in str(note)


def test_world_vertices_of_the_tracked_mesh(tmp_path: Path) -> None:
    write_multiface(tmp_path)
    tracking = read(tmp_path).tracking
    expected = VERTICES @ HEAD_TO_WORLD.T + HEAD + 2 * np.array([3.0, 1.0, -2.0])
    assert tracking.world_vertices()[2] == pytest.approx(expected)
    assert np.array_equal(np.asarray(tracking.faces), FACES)


def test_the_binary_mesh_is_preferred_and_an_obj_alone_will_do(tmp_path: Path) -> None:
    made = write_multiface(tmp_path)
    (2 * VERTICES).astype("<f4").tofile(made.mesh("000003", ".bin"))
    assert read(tmp_path).tracking.vertices[0] == pytest.approx(2 * VERTICES)
    for frame in made.frames:
        made.mesh(frame, ".bin").unlink()
    assert read(tmp_path).tracking.vertices[0] == pytest.approx(VERTICES)


def test_a_binary_alone_gives_no_faces_and_says_so(tmp_path: Path) -> None:
    made = write_multiface(tmp_path)
    for frame in made.frames:
        made.mesh(frame, ".obj").unlink()
    capture = read(tmp_path)
    assert capture.tracking.faces is None
    assert "mesh_without_faces" in [one.kind for one in capture.left_out]


def test_polygons_become_fans(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1/1 2/1/1 3/1/1 4/1/1\n")
    assert read_obj(tmp_path / "a.obj")[1].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_without_tracked_meshes_there_is_no_tracking(tmp_path: Path) -> None:
    write_multiface(tmp_path)
    shutil.rmtree(tmp_path / "tracked_mesh")
    capture = read(tmp_path)
    assert capture.tracking is None and capture.frame_ids == ("000003", "000006", "000009")


def test_a_frame_without_tracked_mesh_is_left_out(tmp_path: Path) -> None:
    made = write_multiface(tmp_path)
    made.mesh("000006", "_transform.txt").unlink()
    capture = read(tmp_path)
    assert capture.frame_ids == ("000003", "000009")
    assert "frame 000006: no tracked mesh or no head pose" in map(str, capture.left_out)


def test_cameras_without_images_or_calibration_are_left_out(tmp_path: Path) -> None:
    made = write_multiface(tmp_path)
    shutil.rmtree(tmp_path / "images" / SEGMENT / "400002")
    save(made.image("400099", "000003"), pattern(40, 64, 0))
    capture = read(tmp_path)
    assert [view.name for view in capture.views] == ["400001", "400003", "400004", "400005"]
    assert "camera 400002: in KRT, but has no images" in map(str, capture.left_out)
    assert "camera 400099: has images, but is not in KRT" in map(str, capture.left_out)


def test_a_listed_frame_without_images_is_reported(tmp_path: Path) -> None:
    write_multiface(tmp_path)
    with (tmp_path / "frame_list.txt").open("a") as file:
        file.write(f"{SEGMENT} 000012\nANOTHER 000015\n")
    said = [str(one) for one in read(tmp_path).left_out if "frame_list" in str(one)]
    assert said == ["frame 000012: in frame_list.txt, but no camera has an image"]


@pytest.mark.parametrize(
    ("frames", "expected", "fps"),
    [
        (None, ("000003", "000006", "000009"), 30.0),
        (FrameRange(start=1), ("000006", "000009"), 30.0),
        (FrameRange(step=2), ("000003", "000009"), 15.0),
        (("000006",), ("000006",), 0.0),
    ],
)
def test_frames_and_their_rate(
    tmp_path: Path, frames: FrameRange | tuple[str, ...] | None, expected: tuple[str, ...], fps: float
) -> None:
    write_multiface(tmp_path)
    capture = read(tmp_path, frames=frames)
    assert (capture.frame_ids, capture.fps) == (expected, fps)


def test_masks_are_found_where_they_are(tmp_path: Path) -> None:
    write_multiface(tmp_path)
    mask = tmp_path / "masks" / SEGMENT / "400003" / "000006.png"
    save(mask, np.zeros((64, 40), np.uint8))
    assert read(tmp_path).masks == {(2, 1): FilePicture(mask)}


def test_distortion_in_krt_gives_the_camera_a_lens(tmp_path: Path) -> None:
    made = write_multiface(tmp_path)
    lines = made.krt.read_text().splitlines()
    lines[4] = "-0.1 0.02 0.001 -0.002 0"
    made.krt.write_text("\n".join(lines))
    first, second, *_ = read(tmp_path).views
    assert first.lens.coefficients.tolist() == [-0.1, 0.02, 0.001, -0.002, 0]
    assert second.lens is None


@pytest.mark.captures
def test_the_shared_capture_has_its_calibration_at_image_size(captures_folder: Path) -> None:
    root = captures_folder / "mugsy"
    capture = read(root)
    assert (len(capture.views), len(capture.frame_ids)) == (38, 12)
    assert any("already scaled" in str(one) for one in capture.left_out)


@pytest.mark.captures
def test_the_scaled_calibration_is_the_real_one_times_a_plain_factor(captures_folder: Path) -> None:
    # 384 / 2048, principal point included: that is scaling in continuous coordinates, centres at 0.5.
    full = {camera.name: camera.K for camera in read_krt(captures_folder / "mugsy_real" / "KRT")}
    for camera in read_krt(captures_folder / "mugsy" / "KRT"):
        assert camera.K[:2] == pytest.approx(full[camera.name][:2] * 384 / 2048, rel=1e-6)


def test_what_other_systems_leave_in_folders_is_no_picture(tmp_path: Path) -> None:
    fixture = write_multiface(tmp_path)
    sound = read(tmp_path)
    images = fixture.image("x", "x").parents[2]
    for folder in [images, *(path for path in images.rglob("*") if path.is_dir())]:
        (folder / "._000003.png").write_bytes(b"\0\5\26\7")
        (folder / ".Trash").mkdir()
    for path in fixture.image("400001", "x").parent.glob("0*.png"):
        path.rename(path.with_suffix(".PNG"))
    found = read(tmp_path)
    assert found.frame_ids == sound.frame_ids
    assert {k: p.file.stem for k, p in found.images.items()} == {k: p.file.stem for k, p in sound.images.items()}
