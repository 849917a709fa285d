"""ActorsHQ: the actor filmed into the layout, an example by hand, and what is wrong with a table."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from facefolds_core.captures.sources import actorshq
from tests.captures.fixtures import pattern, save
from tests.filmed import Reader, check_same, film, save_jpeg, scene_of

read = Reader("actorshq")


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """In metres, as ActorsHQ stores it."""
    root, truth, rows = tmp_path_factory.mktemp("4x"), film(), ["name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py"]
    for c, camera in enumerate(truth.cameras):
        w, h = camera.width, camera.height
        turn = cv2.Rodrigues(camera.rotation.T)[0][:, 0]
        K = [camera.K[0, 0] / w, camera.K[1, 1] / h, camera.K[0, 2] / w, camera.K[1, 2] / h]
        numbers = np.array([*turn, *(camera.centre / 1000), *K]).tolist()
        rows.append(",".join([camera.name, str(w), str(h), *map(repr, numbers)]))
        for k in range(truth.frames):
            save_jpeg(root / "rgbs" / camera.name / f"{camera.name}_rgb{k:06d}.jpg", truth.images[c, k])
            save(root / "masks" / camera.name / f"{camera.name}_mask{k:06d}.png", truth.mattes[c, k])
    (root / "calibration.csv").write_text("\n".join(rows) + "\n")
    return root


def test_the_filmed_actor_comes_back(filmed: Path, tmp_path: Path) -> None:
    truth = film()
    scene = scene_of(filmed, "actorshq", tmp_path / "scene", truth.names, fps=truth.fps)
    check_same(scene, truth, lossless=False, mattes="all")


def test_an_example_by_hand(tmp_path: Path) -> None:
    """One camera 2 m before the origin, looking along +z, and one on its right, looking along -x; with blanks."""
    (tmp_path / "calibration.csv").write_text(
        "name, w, h, rx, ry, rz, tx, ty, tz, fx, fy, px, py\n"
        "Cam001, 40, 20, 0.0, 0.0, 0.0, 0.0, 0.0, -2.0, 1.5, 3.0, 0.5, 0.25\n"
        "Cam002, 40, 20, 0.0, -1.5707963267948966, 0.0, 2.0, 0.0, 0.0, 1.5, 3.0, 0.5, 0.25\n"
    )
    for name in ("Cam001", "Cam002"):
        save(tmp_path / "rgbs" / name / f"{name}_rgb000007.jpg", pattern(40, 20, 0))
    capture = read(tmp_path)
    first, second = (view.camera for view in capture.views)
    assert first.K.tolist() == [[60, 0, 20], [0, 60, 5], [0, 0, 1]]
    assert first.centre.tolist() == [0, 0, -2]
    assert first.forward.tolist() == [0, 0, 1]
    np.testing.assert_allclose(second.centre, [2, 0, 0], atol=1e-12)
    np.testing.assert_allclose(second.forward, [-1, 0, 0], atol=1e-12)
    assert capture.frame_ids == ("000007",)
    assert not capture.masks


def test_the_rate_is_the_rigs(filmed: Path) -> None:
    assert read(filmed).fps == 25


def test_cameras_of_the_rarer_shape_and_without_pictures_are_left_out(copied: Path) -> None:
    shutil.rmtree(copied / "rgbs" / "A001")
    for path in (copied / "rgbs" / "A002").iterdir():
        save(path, pattern(64, 48, 0))
    kinds = {(one.kind, one.camera) for one in read(copied).left_out}
    assert kinds == {("no_images", "A001"), ("other_size", "A002")}


BAD = [
    ("no column", ",py\n", ",pz\n", "without all columns", "line 1"),
    ("short line", "A001,48", "48", "too few or too many", "line 3"),
    ("no number", "A001,48", "A001,wide", "not a number", "line 3 (camera A001), w"),
    ("infinite", "A001,48", "A001,1e999", "not a number", "line 3 (camera A001), w"),
    ("twice", "\nA001,", "\nA000,", "appears twice", "line 3"),
]


@pytest.mark.parametrize(("old", "new", "message", "place"), [case[1:] for case in BAD], ids=[case[0] for case in BAD])
def test_what_is_wrong_with_the_table_is_said(
    filmed: Path, tmp_path: Path, old: str, new: str, message: str, place: str
) -> None:
    text = (filmed / "calibration.csv").read_text()
    assert old in text
    (tmp_path / "calibration.csv").write_text(text.replace(old, new, 1))
    read.refused(tmp_path, message, place)


def test_other_pictures_than_the_table_says_are_refused(filmed: Path, tmp_path: Path) -> None:
    for name in film().names:
        save(tmp_path / "rgbs" / name / f"{name}_rgb000000.jpg", pattern(48, 48, 0))
    shutil.copy(filmed / "calibration.csv", tmp_path)
    read.refused(tmp_path, "another shape")


def test_a_sequence_suggests_the_smallest_scale(filmed: Path, tmp_path: Path) -> None:
    for scale in ("1x", "4x"):
        (tmp_path / scale).mkdir()
        shutil.copy(filmed / "calibration.csv", tmp_path / scale)
    assert actorshq.recognise(tmp_path).path == tmp_path / "4x"
    assert actorshq.recognise(tmp_path / "1x") and not actorshq.recognise(tmp_path / "4x" / "rgbs")
