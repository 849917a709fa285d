"""Pictures of a list sorted into cameras and frames where every picture has a calibration of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.arrangement import Shot, arrange, mean_calibration
from facefolds_core.captures.gathering import Calibration
from facefolds_core.errors import UserError
from tests.captures.fixtures import write_transforms
from tests.filmed import Reader, check_same, film, scene_of, write_film

read = Reader("transforms")


@pytest.mark.parametrize(
    ("labels", "timed", "jitter"),
    [
        ("{c}/{k}.png", False, 0.0),
        ("{c}/{k}.png", False, 1e-4),
        ("f{k}/{c}.png", False, 1e-4),
        ("images/{n}.png", True, 1e-4),
        ("{c}/{k}.png", True, 1e-4),
    ],
)
def test_pictures_with_jittered_poses_are_one_camera(tmp_path: Path, labels: str, timed: bool, jitter: float) -> None:
    root = write_film(tmp_path, labels, jitter, timed)
    capture = read(root)
    assert (len(capture.views), len(capture.frame_ids), len(capture.images)) == (5, 3, 15)
    names = tuple(view.name for view in capture.views)
    scene = scene_of(root, "transforms", tmp_path / "scene", names)
    check_same(scene, film(), dict(zip(names, film().names, strict=True)), tolerance=max(1e-6, 10 * jitter))


def test_a_jittered_focal_length_is_averaged(tmp_path: Path) -> None:
    f = film().cameras[0].K[0, 0]
    capture = read(write_film(tmp_path, "{c}/{k}.png", jitter=0, fl_x=f * 1.003))
    assert capture.views[0].camera.K[0, 0] == pytest.approx(f * 1.001)


def test_a_camera_that_moves_is_none_of_several(tmp_path: Path) -> None:
    read.refused(write_film(tmp_path, "{c}/{k}.png", jitter=0.05, timed=True), "one time only")


def test_a_walk_around_a_statue_stays_static(tmp_path: Path) -> None:
    """Photos in folders of three, as a phone sorts them, each from another place."""
    capture = read(write_film(tmp_path, "{c}/{n}.png", jitter=0.05))
    assert (len(capture.views), len(capture.frame_ids)) == (15, 1)


def shots(jitter: float, cameras: int) -> list[Shot]:
    """Three frames of cameras 30 degrees apart, in folders."""

    def pose(c: int, k: int) -> np.ndarray:
        angle = np.radians(30 * c)
        return np.column_stack([np.eye(3), [np.sin(angle) + jitter * k, 0, np.cos(angle)]])

    return [Shot(str(k), f"c{c}", None, pose(c, k)) for c in range(cameras) for k in range(3)]


def test_two_cameras_that_jitter_are_too_few_to_tell(tmp_path: Path) -> None:
    assert len(arrange(shots(1e-3, 3), tmp_path).cameras) == 3
    assert len(arrange(shots(1e-3, 2), tmp_path).cameras) == 6


def test_one_camera_in_place_does_not_hide_the_jitter_of_others(tmp_path: Path) -> None:
    some = shots(1e-3, 4)
    some[:3] = [replace(shot, w2c=some[0].w2c) for shot in some[:3]]
    assert [len(of) for of in arrange(some, tmp_path).cameras.values()] == [3, 3, 3, 3]


def test_two_lens_models_of_one_camera_are_refused(tmp_path: Path) -> None:
    one = Calibration("a", np.eye(3), np.eye(3, 4), tmp_path, "frames[0]", np.zeros(5))
    with pytest.raises(UserError, match="two lens models"):
        mean_calibration([one, replace(one, coefficients=np.zeros(4), fisheye=True, place="frames[1]")])


@pytest.mark.parametrize("keys", [{"camera_model": "OPENCV_FISHEYE"}, {"is_fisheye": True}])
def test_a_fisheye_of_transforms_json_has_a_fisheyes_lens(tmp_path: Path, keys: dict[str, object]) -> None:
    write_transforms(tmp_path, k1=0.03, k2=0.006, k3=0.0004, k4=0.0001, **keys)
    view = read(tmp_path).views[0]
    assert view.lens.fisheye
    assert view.lens.coefficients.tolist() == [0.03, 0.006, 0.0004, 0.0001]
