"""scene.json: round trip and damage."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene, read_scene, write_scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity


def scene(folder: Path) -> Scene:
    K = np.array([[100 / 3, 0, 20.1], [0, 31.7, 30.3], [0, 0, 1]])
    cameras = tuple(Camera(name, K, np.concatenate([np.eye(3), np.full((3, 1), 1 / 7)], 1), 40, 60) for name in "abc")
    return Scene(
        subject="head",
        cameras=cameras,
        splits=("train", "holdout", "train"),
        frame_ids=("000003", "000006"),
        times=np.array([0, 1 / 30]),
        fps=30.0,
        from_capture=Similarity(1 / 3, np.eye(3), np.array([1.0, 2, 3])),
        left_out=("camera d: culled",),
        folder=folder,
    )


def test_round_trip_is_exact(tmp_path: Path) -> None:
    write_scene(scene(tmp_path), tmp_path)
    back, made = read_scene(tmp_path), scene(tmp_path)
    assert [
        np.array_equal(b.K, m.K) and np.array_equal(b.w2c, m.w2c)
        for b, m in zip(back.cameras, made.cameras, strict=True)
    ] == [True] * 3
    assert (back.splits, back.frame_ids, back.left_out) == (made.splits, made.frame_ids, made.left_out)
    assert np.array_equal(back.times, made.times)
    assert back.from_capture.scale == made.from_capture.scale


def test_indices_of_a_split(tmp_path: Path) -> None:
    assert scene(tmp_path).indices("train") == [0, 2]


def test_masks_and_surface_are_optional(tmp_path: Path) -> None:
    assert scene(tmp_path).open_masks() is None
    assert scene(tmp_path).load_surface() is None


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut short", b"no archive"])
def test_a_damaged_tracked_mesh_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "surface.npz").write_bytes(content)
    with pytest.raises(UserError, match="tracked mesh of the scene is damaged") as caught:
        scene(tmp_path).load_surface()
    assert caught.value.file == tmp_path / "surface.npz"


@pytest.mark.parametrize(
    ("change", "message"),
    [({"version": 99}, "another version"), ({"cameras": [{"name": "a"}]}, "garbled"), ({"times": "soon"}, "garbled")],
)
def test_a_garbled_scene_is_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    write_scene(scene(tmp_path), tmp_path)
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(UserError, match=message):
        read_scene(tmp_path)
