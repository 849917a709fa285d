"""Clean plates and mattes: from a capture to the scene, for training; masks stay what scoring uses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.actor import write_capture
from facefolds_core.captures.assembly import write_plan
from facefolds_core.captures.picture import FilePicture
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import CaptureParams, NormalizeParams
from tests.captures.fixtures import SEGMENT, pattern, plan_of, save, write_multiface


def normalized(root: Path) -> Scene:
    params = NormalizeParams(long_side=32, short_side=20)
    return write_plan(plan_of(root, params), params)


def test_a_capture_without_them_gives_none(tmp_path: Path) -> None:
    write_multiface(tmp_path / "capture")
    scene = normalized(tmp_path / "capture")
    assert (scene.open_plates(), scene.open_mattes()) == (None, None)


def test_plates_and_mattes_of_all_cameras_are_kept(tmp_path: Path) -> None:
    root = tmp_path / "capture"
    made = write_multiface(root)
    for c, camera in enumerate(made.cameras):
        plate = pattern(40, 64, 10 + c)
        save(root / "plates" / f"{camera.name}.png", plate)
        save(root / "mattes" / SEGMENT / camera.name / "000006.png", np.full((64, 40), 50 * c, np.uint8))
    scene = normalized(root)
    plates, mattes = scene.open_plates(), scene.open_mattes()
    assert [camera.name for camera in scene.cameras] == [camera.name for camera in made.cameras]
    assert (plates.keys(), mattes.keys()) == ([(c, 0) for c in range(5)], [(c, 1) for c in range(5)])
    for c, camera in enumerate(made.cameras):
        whole = FilePicture(root / "plates" / f"{camera.name}.png").rgb("").astype(float)
        assert np.abs(plates.image(c, 0) - whole.reshape(32, 2, 20, 2, 3).mean((1, 3))).max() <= 0.5
        assert (mattes.image(c, 1) == 50 * c).all()
    assert scene.open_masks() is None


def test_a_plate_of_another_shape_is_refused(tmp_path: Path) -> None:
    write_multiface(tmp_path / "capture")
    save(tmp_path / "capture" / "plates" / "400002.png", pattern(20, 30, 0))
    with pytest.raises(UserError, match="different sizes") as caught:
        normalized(tmp_path / "capture")
    assert "clean plate of camera 400002" in str(caught.value)


def test_the_actor_has_them_when_asked_and_they_agree_with_its_pictures(tmp_path: Path) -> None:
    params = CaptureParams(cameras=3, frames=1, height=48, width=32, plates=True, mattes=True)
    write_capture(tmp_path, params)
    for camera in ("A000", "A001", "A002"):
        image = FilePicture(next((tmp_path / "images").glob(f"*/{camera}/*.png"))).rgb("")
        matte = FilePicture(next((tmp_path / "mattes").glob(f"*/{camera}/*.png"))).opacity("")
        plate = FilePicture(tmp_path / "plates" / f"{camera}.png").rgb("")
        # Pixels beside the subject are smoothed with it: away from it the room is the same to the bit.
        near = np.pad(matte[..., 0], 1)
        beside = np.max([near[i : i + 48, j : j + 32] for i in range(3) for j in range(3)], 0) > 0
        assert np.array_equal(image[~beside], plate[~beside])
        assert (~beside).mean() > 0.1
        assert np.abs(image[matte[..., 0] == 255].astype(int) - plate[matte[..., 0] == 255]).mean() > 10


def test_the_actor_has_none_without_being_asked(tmp_path: Path) -> None:
    write_capture(tmp_path, CaptureParams(cameras=3, frames=1, height=16, width=16, plates=False))
    assert not (tmp_path / "plates").exists() and not (tmp_path / "mattes").exists()
