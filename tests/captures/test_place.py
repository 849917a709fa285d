"""The subject's place: given in params.yaml, drawn over the pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.assembly import Plan, write_plan
from facefolds_core.captures.place import BALL, ball_outline
from facefolds_core.captures.scene import read_scene
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import open_picture
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.params import NormalizeParams
from tests.captures.fixtures import HEAD, plan_of, world_camera, write_multiface


def _plan(root: Path, **keys: Any) -> Plan:
    write_multiface(root)
    return plan_of(root, **keys)


def test_a_given_centre_is_the_origin(tmp_path: Path) -> None:
    where = tuple(float(x) for x in HEAD + np.array([20.0, -30.0, 10.0]))
    scene = _plan(tmp_path / "c", centre=where).scene
    assert scene.from_capture.apply(np.array(where)) == pytest.approx([0, 0, 0], abs=1e-9)
    assert np.median([np.linalg.norm(camera.centre) for camera in scene.cameras]) == pytest.approx(1)


def test_a_given_radius_stands_in_the_scene_in_its_units(tmp_path: Path) -> None:
    plan = _plan(tmp_path / "c", radius=300.0)
    write_plan(plan, NormalizeParams())
    assert read_scene(plan.scene.folder).radius == pytest.approx(300.0 * plan.scene.from_capture.scale)


def test_a_radius_in_another_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="much too small") as caught:
        _plan(tmp_path / "c", radius=0.3)  # metres, the capture's are millimetres
    assert caught.value.place == "radius"


def test_rays_through_the_outline_touch_the_ball() -> None:
    camera = world_camera("a", 40, 20).transformed(Similarity(1e-3, np.eye(3), -1e-3 * HEAD))
    origins, directions = camera.rays(ball_outline(camera, 0.2))
    nearest = origins - (origins * directions).sum(-1, keepdims=True) * directions
    np.testing.assert_allclose(np.linalg.norm(nearest, axis=-1), 0.2, rtol=1e-9)


def test_the_ball_is_drawn_over_every_camera(tmp_path: Path) -> None:
    plan = _plan(tmp_path / "c", radius=60.0)
    scene = write_plan(plan, NormalizeParams())
    sheet = np.asarray(open_picture(scene.folder / "place.png")).astype(int)
    orange = (np.abs(sheet - np.array(BALL)).sum(-1) < 60).sum()
    assert orange > 20 * len(scene.cameras)
