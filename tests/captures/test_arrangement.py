"""Pictures of a list sorted into cameras and frames where every picture has a calibration of its own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.arrangement import Shot, arrange, mean_calibration
from facefolds_core.captures.capture import closest_rotation
from facefolds_core.captures.gathering import Calibration
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from tests.captures.fixtures import intrinsics, opengl_matrix, pattern, save
from tests.filmed import Reader, check_same, film, scene_of

read = Reader("transforms")


def moved(camera: Camera, jitter: float, seed: int) -> Camera:
    """Its pose after its place moved by `jitter` of 1000 mm, its axes by `jitter` radians."""
    random = np.random.default_rng(seed)
    turned = closest_rotation(camera.w2c + jitter * np.pad(random.normal(size=(3, 3)), ((0, 0), (0, 1))))
    centre = camera.centre + 1000 * jitter * random.normal(size=3)
    return replace(camera, w2c=np.concatenate([turned[:, :3], -(turned[:, :3] @ centre)[:, None]], 1))


def write(root: Path, labels: str, jitter: float = 1e-4, timed: bool = False, **first: object) -> Path:
    """The film in transforms.json, each picture with a pose of its own; `first` are keys of the first entry."""
    truth, entries = film(), []
    for c, camera in enumerate(truth.cameras):
        for k in range(truth.frames):
            label = labels.format(c=camera.name, k=k, n=c * truth.frames + k)
            save(root / label, truth.images[c, k])
            pose = moved(camera, jitter, 10 * c + k)
            entry = {"file_path": label, "transform_matrix": opengl_matrix(pose), **intrinsics(camera)}
            entries.append(entry | ({"time": k / truth.fps} if timed else {}))
    entries[0] |= first
    (root / "transforms.json").write_text(json.dumps({"frames": entries}))
    return root


@pytest.mark.parametrize(
    ("labels", "timed"),
    [("{c}/{k}.png", False), ("f{k}/{c}.png", False), ("images/{n}.png", True), ("{c}/{k}.png", True)],
)
def test_pictures_with_jittered_poses_are_one_camera(tmp_path: Path, labels: str, timed: bool) -> None:
    root = write(tmp_path, labels, timed=timed)
    capture = read(root)
    assert (len(capture.views), len(capture.frame_ids), len(capture.images)) == (5, 3, 15)
    names = tuple(view.name for view in capture.views)
    scene = scene_of(root, "transforms", tmp_path / "scene", names)
    check_same(scene, film(), dict(zip(names, film().names, strict=True)), tolerance=1e-3)


def test_a_jittered_focal_length_is_averaged(tmp_path: Path) -> None:
    camera = film().cameras[0]
    root = write(tmp_path, "{c}/{k}.png", jitter=0, fl_x=camera.K[0, 0] * 1.003)
    capture = read(root)
    assert capture.views[0].camera.K[0, 0] == pytest.approx(camera.K[0, 0] * 1.001)


def test_a_camera_that_moves_is_none_of_several(tmp_path: Path) -> None:
    read.refused(write(tmp_path, "{c}/{k}.png", jitter=0.05, timed=True), "one time only")


def test_a_walk_around_a_statue_stays_static(tmp_path: Path) -> None:
    """Photos in folders of three, as a phone sorts them, each from another place."""
    capture = read(write(tmp_path, "{c}/{n}.png", jitter=0.05))
    assert (len(capture.views), len(capture.frame_ids)) == (15, 1)


def shots(jitter: float, cameras: int) -> list[Shot]:
    """Three frames of cameras 30 degrees apart, in folders."""
    found = []
    for c in range(cameras):
        angle = np.radians(30 * c)
        for k in range(3):
            w2c = np.eye(3, 4)
            w2c[:, 3] = [np.sin(angle) + jitter * k, 0, np.cos(angle)]
            found.append(Shot(str(k), f"c{c}", None, w2c))
    return found


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
    camera = film().cameras[0]
    save(tmp_path / "0.png", pattern(camera.width, camera.height, 0))
    entry = {"file_path": "0.png", "transform_matrix": opengl_matrix(camera), **intrinsics(camera)}
    lens = {"k1": 0.03, "k2": 0.006, "k3": 0.0004, "k4": 0.0001, **keys}
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": [entry], **lens}))
    (view,) = read(tmp_path).views
    assert view.lens is not None
    assert view.lens.fisheye
    assert view.lens.coefficients.tolist() == [0.03, 0.006, 0.0004, 0.0001]
