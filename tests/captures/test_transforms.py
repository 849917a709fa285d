"""The reader of transforms.json: intrinsics, axes, frames, names, distortion."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.lens import make_lens
from facefolds_core.geometry.cameras import Camera
from tests.captures.fixtures import (
    HEAD,
    RING,
    edit_transforms,
    intrinsics,
    pattern,
    save,
    world_camera,
    write_transforms,
)
from tests.filmed import Reader, film, write_film

read = Reader("transforms")
POINTS = HEAD + np.random.default_rng(0).uniform(-100, 100, (40, 3))


def names(root: Path) -> list[str]:
    return [view.name for view in read(root).views]


def write_without_intrinsics(root: Path, **top: float) -> tuple[Camera, ...]:
    """Entries have none; the keys at the top may."""
    path, cameras = write_transforms(root, **top)
    for entry in range(5):
        edit_transforms(path, entry, fl_x=None, fl_y=None, cx=None, cy=None, w=None, h=None)
    return cameras


def test_projection_with_opengl_axes_and_intrinsics_of_each_entry(tmp_path: Path) -> None:
    _, cameras = write_transforms(tmp_path)
    for view, camera in zip(read(tmp_path).views, cameras, strict=True):
        assert np.abs(view.camera.project(POINTS)[0] - camera.project(POINTS)[0]).max() < 1e-9


def test_global_intrinsics(tmp_path: Path) -> None:
    cameras = write_without_intrinsics(tmp_path, **intrinsics(world_camera(*RING[0])))
    assert pytest.approx(cameras[3].K) == read(tmp_path).views[3].camera.K


def test_angles_of_view_and_centred_principal_point(tmp_path: Path) -> None:
    write_without_intrinsics(tmp_path, camera_angle_x=math.radians(60))
    f = 20 / math.tan(math.radians(30))
    assert pytest.approx(np.array([[f, 0, 20], [0, f, 32], [0, 0, 1]])) == read(tmp_path).views[0].camera.K


def test_pixel_centres_at_whole_numbers_shift_the_principal_point(tmp_path: Path) -> None:
    _, cameras = write_transforms(tmp_path)
    view = read(tmp_path, pixel_centres=0.0).views[0]
    assert view.camera.K[:2, 2] == pytest.approx(cameras[0].K[:2, 2] + 0.5)


def test_entries_without_image_are_left_out_and_reported(tmp_path: Path) -> None:
    write_transforms(tmp_path)
    (tmp_path / "images" / "400002.png").unlink()
    capture = read(tmp_path)
    assert [view.name for view in capture.views] == ["400001", "400003", "400004", "400005"]
    assert [str(one) for one in capture.left_out] == ["frames[1] (images/400002.png): no image images/400002.png"]


def test_paths_without_extension(tmp_path: Path) -> None:
    path, _ = write_transforms(tmp_path)
    edit_transforms(path, 0, file_path="./images/400001")
    assert names(tmp_path)[0] == "400001"


def test_a_static_capture_has_one_frame_and_no_rate(tmp_path: Path) -> None:
    write_transforms(tmp_path)
    capture = read(tmp_path)
    assert (capture.frame_ids, capture.fps, len(capture.images)) == (("0",), 0.0, 5)


@pytest.mark.parametrize("label", ["{c}/{k}.png", "images/{k}/{c}.png"])
def test_folders_of_cameras_or_of_frames(tmp_path: Path, label: str) -> None:
    capture = read(write_film(tmp_path, label), fps=25.0)
    assert tuple(view.name for view in capture.views) == film().names
    assert (capture.frame_ids, capture.fps) == (("0", "1", "2"), 25.0)
    assert capture.images[1, 0].file == tmp_path / label.format(c="A001", k=0)


def test_times_order_the_frames(tmp_path: Path) -> None:
    capture = read(write_film(tmp_path, "{c}/{k}.png", timed=True))
    assert capture.frame_ids == ("0", "0.0333333", "0.0666667")
    assert capture.images[4, 1].file == tmp_path / "A004" / "1.png"


def test_times_that_six_digits_cannot_tell_apart(tmp_path: Path) -> None:
    path = write_film(tmp_path, "{c}/{k}.png", timed=True) / "transforms.json"
    content = json.loads(path.read_text())
    for entry in content["frames"]:
        entry["time"] = 1699999999.0 + round(30 * entry["time"]) / 4
    path.write_text(json.dumps(content))
    assert read(tmp_path).frame_ids == ("1699999999.0", "1699999999.25", "1699999999.5")


def test_same_file_names_in_folders_of_cameras_give_the_folders_names(tmp_path: Path) -> None:
    path, _ = write_transforms(tmp_path)
    for c, (name, _, _) in enumerate(RING):
        save(tmp_path / name / "photo.png", pattern(40, 64, c))
        edit_transforms(path, c, file_path=f"{name}/photo.png")
    assert names(tmp_path) == [name for name, _, _ in RING]


@pytest.mark.parametrize("k1", [-0.3, 0.3])
def test_the_undistorted_image_shows_nothing_from_outside_the_photo(k1: float) -> None:
    K = np.array([[150.0, 0, 83], [0, 151, 57], [0, 0, 1]])
    x, y = make_lens(K, np.array([k1, 0, 0, 0, 0]), 160, 120, "file", "camera").maps(160, 120)
    assert min(x.min(), y.min()) >= -1e-4 and x.max() <= 159 + 1e-4 and y.max() <= 119 + 1e-4


@pytest.mark.captures
def test_the_shared_statue(captures_folder: Path) -> None:
    capture = read(captures_folder / "buddha")
    assert (len(capture.views), capture.frame_ids, capture.left_out) == (67, ("0",), ())
