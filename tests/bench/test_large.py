"""An enlarged capture shows what the small one does."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from bench.large import enlarge, enlarged_krt
from facefolds_core.captures.gathering import Calibration, scaled_intrinsics
from facefolds_core.captures.sources.multiface import read_krt

K = np.array([[500.0, 0, 63.5], [0, 510, 40], [0, 0, 1]])
W2C = np.eye(3, 4)


def calibration(name: str) -> Calibration:
    return Calibration(name, K, W2C, Path("KRT"), "", np.zeros(5))


def test_cameras_see_points_as_many_times_farther_from_the_corner(tmp_path: Path) -> None:
    path = tmp_path / "KRT"
    path.write_text(enlarged_krt([calibration("a"), calibration("b")], 4))
    cameras = read_krt(path)
    small, large = (scaled_intrinsics(one, (1, 1), (1, 1), 0.0) for one in (K, cameras[1].K))
    assert [camera.name for camera in cameras] == ["a", "b"]
    assert large == pytest.approx(np.diag([4.0, 4.0, 1.0]) @ small)


def test_pictures_of_all_kinds_are_enlarged_and_the_rest_copied(tmp_path: Path) -> None:
    source = tmp_path / "small"
    names = "images/S/a/1.png", "masks/S/a/1.png", "plates/a.png"
    for name in names:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(source / name), np.zeros((3, 2), np.uint8))
    (source / "KRT").write_text(enlarged_krt([calibration("a")], 1))
    (source / "frame_list.txt").write_text("S 1\n")
    enlarge(source, tmp_path / "large", 4)
    pictures = list((tmp_path / "large").rglob("*.png"))
    assert {path.relative_to(tmp_path / "large").as_posix() for path in pictures} == set(names)
    assert {np.shape(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)) for path in pictures} == {(12, 8)}
    assert (tmp_path / "large" / "frame_list.txt").read_text() == "S 1\n"
