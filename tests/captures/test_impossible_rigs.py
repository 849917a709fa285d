"""Rigs and head poses well formed and wrong all the same: calibration beyond sense."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.visibility import check_sight
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from tests.captures.fixtures import (
    RING,
    edit_transforms,
    krt_text,
    opengl_matrix,
    pose_text,
    world_camera,
    write_multiface,
    write_transforms,
)
from tests.captures.test_bad_captures import refused, run

CAMERAS = tuple(world_camera(*view) for view in RING)


def rig(change: Callable[[int, Camera], Camera]) -> tuple[Camera, ...]:
    return tuple(change(i, camera) for i, camera in enumerate(CAMERAS))


def turned(i: int, camera: Camera) -> Camera:
    """The second camera turned round about its upright axis."""
    return replace(camera, w2c=np.diag([-1.0, 1, -1]) @ camera.w2c) if i == 1 else camera


def inverted(i: int, camera: Camera) -> Camera:
    """Camera -> world where world -> camera should be.

    The head is moved aside before: on the axis of a camera at the origin, as in Multiface, inverted poses are those of
    a mirrored rig that looks at the head all the same.
    """
    camera = camera.transformed(Similarity(1.0, np.eye(3), np.array([3000.0, 0, -1030])))
    return replace(camera, w2c=np.concatenate([camera.rotation.T, camera.centre[:, None]], 1))


def far(distance: float) -> Callable[[int, Camera], Camera]:
    """The third camera moved backwards."""
    back = np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, distance]])
    return lambda i, camera: replace(camera, w2c=camera.w2c + back) if i == 2 else camera


def focal(f: float) -> Callable[[int, Camera], Camera]:
    K = np.array([[f, 0, 20], [0, f, 30], [0, 0, 1]])
    return lambda i, camera: replace(camera, K=K) if i == 2 else camera


RIGS: dict[str, tuple[Callable[[int, Camera], Camera], str, str]] = {
    "one turned away": (turned, "look past the subject", "camera 400002"),
    "all inverted": (inverted, "no camera sees the subject|look past the subject", "400001"),
    "one at 1e300": (far(1e300), "garbled KRT|not a number", "400003"),
    "one at 1e8": (far(1e8), "absurdly near", "camera 400003"),
    "f of 1e-12": (focal(1e-12), "singular", "400003"),
    "f of 1e7": (focal(1e7), "focal lengths that no camera has", "camera 400003"),
    "one place": (lambda i, camera: replace(camera, w2c=CAMERAS[0].w2c), "in one place|in the subject's centre", ""),
    "mirrored": (lambda i, c: replace(c, w2c=np.diag([-1.0, 1, 1]) @ c.w2c), "(not a|no) rotation", "400001"),
}


@pytest.mark.parametrize(("change", "message", "camera"), RIGS.values(), ids=RIGS)
@pytest.mark.parametrize("source", ["multiface", "transforms"])
def test_cameras_that_do_not_see_the_subject(
    tmp_path: Path, source: str, change: Callable[[int, Camera], Camera], message: str, camera: str
) -> None:
    cameras = rig(change)
    if source == "multiface":
        write_multiface(tmp_path / "c").krt.write_text(krt_text(cameras))
    else:
        path, _ = write_transforms(tmp_path / "c")
        for i, one in enumerate(cameras):
            place = {"transform_matrix": opengl_matrix(one)} if np.abs(one.w2c).max() < 1e9 else {"cx": 1e300}
            edit_transforms(path, i, **place, fl_x=one.K[0, 0], fl_y=one.K[1, 1])
    # Pictures of one pose are one camera's, which has their folder's name.
    front = "400001" if len({one.w2c.tobytes() for one in cameras}) > 1 else "images"
    error = refused(tmp_path / "c", source, front=front if source == "transforms" else None)
    assert re.search(message, error.message) and camera in str(error), str(error)


def test_a_close_up_that_shows_a_part_of_the_head_is_fine(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    close = np.array([[1000.0, 0, 75], [0, 1000, -62], [0, 0, 1]])  # most of the head lies beyond the picture's edge
    made.krt.write_text(krt_text(rig(lambda i, c: replace(c, K=close) if i == 2 else c)))
    assert (run(tmp_path / "c", "multiface").scene / "scene.json").exists()


def test_a_frame_whose_head_is_nowhere(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c", tuple(f"{k:06d}" for k in range(40)))
    pose = np.loadtxt(made.mesh("000007", "_transform.txt"))
    made.mesh("000007", "_transform.txt").write_text(pose_text(pose[:, :3], pose[:, 3] + [3000, 0, 0]))
    error = refused(tmp_path / "c", "multiface")
    assert (error.message, error.place) == ("the tracked mesh lies in no camera's picture", "frame 000007")


def test_head_poses_that_turn_every_way(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c", turn=120)
    assert refused(tmp_path / "c", "multiface").message == "the head poses contradict one another"


def test_cameras_in_the_centre_are_named() -> None:
    camera = Camera("a", np.array([[30.0, 0, 20], [0, 30, 20], [0, 0, 1]]), np.eye(3, 4), 40, 40)
    moved = replace(camera, name="b", w2c=np.eye(3, 4))
    with pytest.raises(UserError, match="absurdly near"):
        check_sight([camera, moved], ["0"], None, "c")
