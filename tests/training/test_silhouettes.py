"""Where the subject is in training pictures: from mattes, clean plates or the pictures themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.scene import SPHERE_CENTRE, Scene
from facefolds_core.frame_store import write_frames
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.silhouettes import Silhouettes, silhouettes
from facefolds_core.training.volume import kernel
from facefolds_core.training.volume.cameras import CameraFit
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.room import Room
from tests.scenes import OPAQUE, make_scene, render

SIZE = 48
PARAMS = ExplicitParams()


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """A ball before black. Camera 0 has a matte of 50, camera 1 a clean plate."""
    made = make_scene(tmp_path, size=SIZE)
    write_frames(made.folder / "mattes.arrow", (SIZE, SIZE, 1), [(0, 0, np.full((SIZE, SIZE, 1), 50, np.uint8))])
    write_frames(made.folder / "plates.arrow", (SIZE, SIZE, 3), [(1, 0, np.zeros((SIZE, SIZE, 3), np.uint8))])
    return made


def _volume(frame: int = 0) -> Volume:
    voxel = 0.02
    axis = -0.4 + voxel * np.arange(41)
    distance = np.linalg.norm(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1), axis=-1)
    grid = np.zeros((41, 41, 41, 4), np.float32)
    grid[..., 0] = np.where(distance < OPAQUE[0].radius, kernel.LIMIT, -kernel.LIMIT)
    room = Room(np.zeros(3, np.float32), 1.0, 0.45, PARAMS.room, PARAMS.environment)
    lower = np.array(SPHERE_CENTRE) - 0.4
    volume = Volume(grid, lower, voxel, 0.7, room, 0, 30.0, CameraFit.alike(1, PARAMS.cameras))
    return replace(volume, frame=frame)


def _found(scene: Scene, frame: int = 0, **params: Any) -> Silhouettes | None:
    return silhouettes(scene, _volume(frame), ExplicitParams.model_validate(params))


def _picture(found: Silhouettes, place: int) -> np.ndarray:
    pixels = np.arange(SIZE * SIZE)
    return found.of(np.full(len(pixels), place), pixels).reshape(SIZE, SIZE)


def test_mattes_stand_above_plates_and_plates_above_pictures(scene: Scene) -> None:
    found = _found(scene)
    assert found is not None and (found.row >= 0).all()
    np.testing.assert_allclose(_picture(found, 0), 50 / 255, rtol=1e-6)
    for place, camera in enumerate(scene.indices("train")):
        truth = render(scene.cameras[camera], OPAQUE, 0)[1] > 0.5
        shown = _picture(found, place) > 0.5
        if place > 0:
            assert (shown & truth).sum() > 0.9 * (shown | truth).sum()


def test_a_matte_of_another_frame_is_none_of_this_one(scene: Scene) -> None:
    found = _found(scene, frame=1)
    assert found is not None and found.frame == 1
    assert not np.allclose(_picture(found, 0), 50 / 255)


def test_some_cameras_are_enough(scene: Scene) -> None:
    found = _found(scene, pruning={"beside_cameras": 4})
    assert found is not None
    assert found.row[0] >= 0 and (found.row[[1, 4]] < 0).all()  # 0, 2, 3 and 5 are looked at


def test_pictures_that_are_too_few_to_vote_say_nothing(scene: Scene) -> None:
    found = _found(scene, outlines={"vote": {"min_views": 20}})
    assert found is not None and (found.row[:2] >= 0).all() and (found.row[2:] < 0).all()


def test_nothing_is_looked_for_where_nothing_is_cleared_by_it(scene: Scene) -> None:
    assert _found(scene, pruning={"beside_gain": 0.0}) is None
