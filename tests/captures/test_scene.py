"""scene.json: round trip and damage."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene, read_scene, write_scene
from facefolds_core.errors import UserError
from facefolds_core.facts import fact
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.torso import Torso
from facefolds_core.geometry.track import Track
from tests.memory import peak_of


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
        left_out=(fact("culled", camera="d", elevation=70.25, azimuth=-3.0), fact("no_mesh", folder="here")),
        folder=folder,
    )


def test_round_trip_is_exact(tmp_path: Path) -> None:
    track = Track.of([np.eye(3), np.diag([-1.0, -1, 1])], [[0, 0, 0], [0.1, 1 / 3, 0]])
    made = replace(scene(tmp_path), poses=track)
    write_scene(made, tmp_path)
    back = read_scene(tmp_path)
    for b, m in zip(back.cameras, made.cameras, strict=True):
        assert np.array_equal(b.K, m.K) and np.array_equal(b.w2c, m.w2c)
    assert (back.splits, back.frame_ids, back.left_out) == (made.splits, made.frame_ids, made.left_out)
    assert np.array_equal(back.times, made.times)
    assert back.from_capture.scale == made.from_capture.scale
    assert np.array_equal(back.poses.quaternions, track.quaternions)
    assert np.array_equal(back.poses.translations, track.translations)


def test_views_of_a_turning_head_spread_over_the_frames(tmp_path: Path) -> None:
    turned = replace(scene(tmp_path), poses=Track.of([np.eye(3)] * 2, [[0, 0, 0], [0.1, 0, 0]]))
    assert [view.name for view in turned.views_of("train")] == ["a", "c"]
    first, second = (view.w2c.tolist() for view in turned.views_of("train"))
    assert first == turned.camera_in_head(0, 0).w2c.tolist()
    assert second == turned.camera_in_head(2, 1).w2c.tolist()
    assert len(turned.views_of("train", 2)) == 4
    assert [view.name for view in scene(tmp_path).views_of("train", 2)] == ["a", "c"]
    torso = Torso.at([0.0, 0.0, -1.0], 0.0, 0.1, turned.poses.at(1))
    *posed, one, two = turned.with_torso(torso).views_of("train")
    assert [view.w2c.tolist() for view in posed] == [first, second]
    assert [view.w2c.tolist() for view in (one, two)] == [turned.camera_in_head(i, 1).w2c.tolist() for i in (0, 2)]
    assert scene(tmp_path).with_torso(torso).poses is None


def test_masks_and_surface_are_optional(tmp_path: Path) -> None:
    assert scene(tmp_path).open_masks() is None
    assert scene(tmp_path).load_surface() is None


def test_a_tracked_mesh_stays_in_its_file(tmp_path: Path) -> None:
    vertices = np.random.default_rng(0).normal(size=(2, 500_000, 3)).astype(np.float32)
    np.savez(tmp_path / "surface.npz", vertices=vertices, faces=np.array([[0, 1, 2]], np.int32))
    found = scene(tmp_path).load_surface()
    assert np.array_equal(found[0], vertices) and found[1].tolist() == [[0, 1, 2]]
    assert peak_of(lambda: scene(tmp_path).load_surface()) < 6e6  # of 12 MB; a frame's mask of what is finite has 1.5


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut short", b"no archive", None], ids=repr)
def test_a_damaged_tracked_mesh_is_refused(tmp_path: Path, content: bytes | None) -> None:
    """None: a byte changed within."""
    path = tmp_path / "surface.npz"
    np.savez(path, vertices=np.ones((2, 100, 3), np.float32), faces=np.array([[0, 1, 2]], np.int32))
    data = bytearray(path.read_bytes())
    data[1000] ^= 1
    path.write_bytes(data if content is None else content)
    with pytest.raises(UserError, match="tracked mesh of the scene is damaged") as caught:
        scene(tmp_path).load_surface()
    assert caught.value.file == path


POSE = {"quaternion": [1, 0, 0, 0], "translation": [0, 0, 0]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 99}, "another version"),
        ({"cameras": [{"name": "a"}]}, "garbled"),
        ({"times": "soon"}, "garbled"),
        *(({"poses": poses}, "garbled") for poses in ([], [POSE], "none", [{}, {}])),
    ],
)
def test_a_garbled_scene_is_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    write_scene(scene(tmp_path), tmp_path)
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(UserError, match=message):
        read_scene(tmp_path)
