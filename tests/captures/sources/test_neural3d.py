"""Neural 3D Video: the actor filmed into it, an example by hand, rows that do not fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.sources import neural3d
from facefolds_core.geometry.cameras import Camera
from tests.filmed import Reader, check_same, film, save_video, scene_of

read = Reader("neural3d")

NAMES = tuple(f"cam{i:02d}" for i in (0, 1, 2, 4, 10))
"""A camera that was taken out has neither video nor row."""


def row(camera: Camera) -> list[float]:
    right, down, forward = camera.rotation
    size = [camera.height, camera.width, camera.K[0, 0]]
    return [*np.stack([down, right, -forward, camera.centre, size], 1).ravel(), 500.0, 2000.0]


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root, truth = tmp_path_factory.mktemp("neural3d"), film()
    for c, name in enumerate(NAMES):
        save_video(root / f"{name}.mp4", truth.images[c], truth.fps)
    np.save(root / "poses_bounds.npy", np.array([row(camera) for camera in truth.cameras]))
    return root


def test_the_filmed_actor_comes_back(filmed: Path, tmp_path: Path) -> None:
    names = dict(zip(NAMES, film().names, strict=True))
    check_same(scene_of(filmed, "neural3d", tmp_path / "scene", NAMES), film(), names)


def test_an_example_by_hand(tmp_path: Path) -> None:
    # Looks along -z of the world, as poses of LLFF do: down is -y, right is x, back is z; full size 40 x 20, f 30.
    matrix = [[0, 1, 0, 5, 20], [-1, 0, 0, 6, 40], [0, 0, 1, 7, 30]]
    np.save(tmp_path / "poses_bounds.npy", np.array([[*np.ravel(matrix), 1.0, 9.0]]))
    save_video(tmp_path / "cam00.mp4", np.zeros((2, 10, 20, 3), np.uint8), 25)
    capture = read(tmp_path)
    (camera,) = [view.camera for view in capture.views]
    assert camera.centre == pytest.approx([5, 6, 7])
    assert camera.forward == pytest.approx([0, 0, -1])
    assert camera.project(np.array([5.0, 8.0, -3.0]))[0] == pytest.approx([10, 2])
    assert camera.project(np.array([7.0, 6.0, -3.0]))[0] == pytest.approx([13, 5])
    assert (capture.fps, capture.frame_ids) == (25.0, ("000000", "000001"))


def test_a_missing_video_and_one_too_many(copied: Path) -> None:
    (copied / "cam04.mp4").rename(copied / "away")
    expected = "4 rows of 17 numbers, one a video (cam00, cam01, cam02, cam10)"
    read.refused(copied, "poses and videos do not belong together", expected, "(5, 17)")


def test_a_row_without_a_rotation(copied: Path) -> None:
    rows = np.load(copied / "poses_bounds.npy")
    wrong = [(2, "a row without a rotation", "row 3 (camera cam04)"), (np.nan, "not a number", "poses_bounds.npy")]
    for factor, message, words in wrong:
        changed = rows.copy()
        changed[3, :3] *= factor
        np.save(copied / "poses_bounds.npy", changed)
        read.refused(copied, message, words)


@pytest.mark.parametrize("content", [b"", b"no array", b"\x93NUMPY\x01\x00", b"\x93NUMPY\x01\x00\x02\x00{\n"])
def test_a_garbled_table(copied: Path, content: bytes) -> None:
    (copied / "poses_bounds.npy").write_bytes(content)
    read.refused(copied, "garbled numbers")


def test_it_is_recognised(filmed: Path) -> None:
    found = neural3d.recognise(filmed)
    assert found is not None and found.keys == {"holdout": ["cam00"]}
