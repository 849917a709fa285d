"""Where a subject faces whose cameras are all that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.captures.actor import make_rig
from facefolds_core.captures.normalization import find_front, nearest_to_axes, normalizing_similarity, orientation
from facefolds_core.captures.sources import SOURCES
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams, Subject

Array = NDArray[np.float64]
FACING, UP = np.array([0.0, 0, -1]), np.array([0.0, -1, 0])
"""Of the actor and of Multiface's rigs."""


def degrees(a: Array, b: Array) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1))))


def found(cameras: Sequence[Camera]) -> Array:
    """The direction that is found, level."""
    facing, up, _ = find_front(cameras, nearest_to_axes(cameras), "capture")
    return np.asarray(orientation(facing, up)[0])


@pytest.mark.parametrize("count", [5, 12, 24, 40])
def test_the_actors_front_is_found(count: int) -> None:
    assert degrees(found(make_rig(CaptureParams(cameras=count)).cameras), FACING) < 4


def test_a_few_cameras_turned_on_their_sides_and_more_above_do_not_matter() -> None:
    cameras = list(make_rig(CaptureParams(cameras=24)).cameras)
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for i in (3, 9, 14, 20):
        cameras[i] = replace(cameras[i], w2c=quarter @ cameras[i].w2c)
    high = [camera for camera in cameras if camera.centre[1] < 0]
    assert degrees(found([*cameras, *high]), FACING) < 5


def test_the_fact_names_the_camera_in_front() -> None:
    cameras = make_rig(CaptureParams(cameras=24)).cameras
    _, _, note = find_front(cameras, nearest_to_axes(cameras), "capture")
    assert note.values == {"camera": "A000", "share": pytest.approx(20 / 24)}
    assert "near camera A000 (83% of them" in str(note)


def test_a_rig_that_is_even_all_around_tells_nothing() -> None:
    cameras = []
    for angle in np.arange(8) * np.pi / 4:
        forward = np.array([np.sin(angle), 0, np.cos(angle)])
        R = np.stack([np.cross(-UP, forward), -UP, forward])
        cameras.append(Camera(f"{angle}", np.eye(3), np.concatenate([R, [[0.0], [0], [2]]], 1), 8, 8))
    with pytest.raises(UserError, match="do not tell where the subject faces"):
        find_front(cameras, np.zeros(3), "capture")


@pytest.mark.captures
@pytest.mark.parametrize("name", ["mugsy", "studio"])
def test_the_front_of_real_rigs_is_found_without_their_meshes(captures_folder: Path, name: str) -> None:
    subject = Subject(source="multiface", path="x")
    capture = SOURCES["multiface"].read(captures_folder / name, subject)
    truth, _ = normalizing_similarity(capture, None)
    without, notes = normalizing_similarity(replace(capture, tracking=None), None)
    assert degrees(without.rotation[0], truth.rotation[0]) < 10
    assert [note.kind for note in notes] == ["front_found"]


@pytest.mark.captures
def test_the_foxs_front_is_found_and_a_manual_one_wins(captures_folder: Path) -> None:
    capture = SOURCES["transforms"].read(captures_folder / "fox", Subject(source="transforms", path="x"))
    given, notes = normalizing_similarity(capture, "0019")
    assert not notes
    camera = next(view.camera for view in capture.views if view.name == "0019")
    assert degrees(given.rotation[0], -camera.forward) < 1e-5
    assert degrees(normalizing_similarity(capture, None)[0].rotation[0], -camera.forward) < 10
