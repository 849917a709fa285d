"""Poses that see the head and are wrong all the same: the pictures do not agree about the tracked mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.actor import write_capture
from facefolds_core.captures.agreement import agreement
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.capture import Capture
from facefolds_core.captures.sources.multiface import read_multiface
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams, NormalizeParams, Subject


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("actor")
    write_capture(folder, CaptureParams(cameras=12, frames=1, height=48, width=32), lambda: None)
    return read_multiface(folder, subject(folder))


def subject(folder: Path) -> Subject:
    return Subject(source="multiface", path=str(folder))


def inverted(cameras: list[Camera]) -> list[Camera]:
    return [replace(c, w2c=np.concatenate([c.rotation.T, c.centre[:, None]], 1)) for c in cameras]


def swapped(cameras: list[Camera]) -> list[Camera]:
    """Each with its neighbour's pose."""
    return [replace(a, w2c=b.w2c) for a, b in zip(cameras, [*cameras[1:], cameras[0]], strict=True)]


def changed(capture: Capture, change: Callable[[list[Camera]], list[Camera]]) -> Capture:
    cameras = change([view.camera for view in capture.views])
    return replace(capture, views=tuple(replace(v, camera=c) for v, c in zip(capture.views, cameras, strict=True)))


def notes(capture: Capture, folder: Path) -> list[str]:
    params = NormalizeParams()
    scene = write_plan(plan_scene(capture, "actor", subject(capture.root), params, folder), params)
    return [str(line) for line in scene.left_out if line.kind == "pictures_disagree"]


def test_a_sound_capture_gets_no_note(capture: Capture, tmp_path: Path) -> None:
    assert notes(capture, tmp_path / "scene") == []


@pytest.mark.parametrize("change", [inverted, swapped])
def test_wrong_poses_that_see_the_head_get_one(
    capture: Capture, tmp_path: Path, change: Callable[[list[Camera]], list[Camera]]
) -> None:
    (note,) = notes(changed(capture, change), tmp_path / "scene")
    assert note.startswith("note: neighbouring cameras' pictures do not agree about the tracked mesh")


def test_pictures_that_show_nothing_are_not_judged(capture: Capture) -> None:
    assert capture.tracking is not None and capture.tracking.faces is not None
    cameras = [view.camera for view in capture.views]
    grey = np.full((48, 32, 3), 128, np.uint8)
    vertices = capture.tracking.world_vertices()[0]
    assert agreement(cameras, vertices, capture.tracking.faces, lambda c: grey) is None
