"""EasyMocap's layout: the actor filmed into it (pictures and videos), an example by hand, garbled files."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.captures.fixtures import pattern, save
from tests.filmed import Reader, check_same, film, save_pictures, save_video, scene_of

read = Reader("easymocap")


def write_calibration(root: Path) -> None:
    """By OpenCV itself."""
    root.mkdir(parents=True, exist_ok=True)
    intri = cv2.FileStorage(str(root / "intri.yml"), cv2.FILE_STORAGE_WRITE)
    extri = cv2.FileStorage(str(root / "extri.yml"), cv2.FILE_STORAGE_WRITE)
    for storage in (intri, extri):
        storage.startWriteStruct("names", cv2.FileNode_SEQ)
        for name in film().names:
            storage.write("", name)
        storage.endWriteStruct()
    for camera in film().cameras:
        K = camera.K - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        intri.write(f"K_{camera.name}", K)
        intri.write(f"dist_{camera.name}", np.zeros((1, 5)))
        extri.write(f"R_{camera.name}", cv2.Rodrigues(camera.rotation)[0])
        extri.write(f"T_{camera.name}", camera.w2c[:, 3:] / 1000)
    intri.release()
    extri.release()


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root, truth = tmp_path_factory.mktemp("easymocap"), film()
    write_calibration(root)
    save_pictures(root / "images", truth.names, truth.images)
    save_pictures(root / "mask", truth.names, truth.mattes)
    return root


def test_the_filmed_actor_comes_back(filmed: Path, tmp_path: Path) -> None:
    check_same(scene_of(filmed, "easymocap", tmp_path / "scene", film().names), film(), mattes="all")


def test_so_it_does_from_videos(tmp_path: Path) -> None:
    truth = film()
    write_calibration(tmp_path)
    for c, name in enumerate(truth.names):
        save_video(tmp_path / "videos" / f"{name}.mp4", truth.images[c], truth.fps)
    check_same(scene_of(tmp_path, "easymocap", tmp_path / "scene", truth.names), truth, lossless=False)


def matrix(name: str, rows: int, columns: int, data: str) -> str:
    """As OpenCV writes it."""
    return f"{name}: !!opencv-matrix\n  rows: {rows}\n  cols: {columns}\n  dt: d\n  data: [{data}]\n"


INTRI = (
    '%YAML:1.0\n---\nnames:\n  - "1"\n  - "Camera_B2"\n'
    + matrix("K_1", 3, 3, "50., 0., 19.5, 0., 5.1e+01, 9.5, 0., 0., 1.")
    + matrix("D_1", 5, 1, "-0.100000, 0.020000,\n         0.001000, -0.002000, 0.000000")
    + "H_1: 20\nW_1: 40.0000000000\n"
    + matrix("K_Camera_B2", 3, 3, "50., 0., 19.5, 0., 51., 9.5, 0., 0., 1.")
)
EXTRI = (
    "%YAML:1.0\n---\n"
    + matrix("R_1", 3, 1, "0., -1.5707963267948966, 0.")
    + matrix("T_1", 3, 1, "0., 0., 2.")
    + matrix("Rot_Camera_B2", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.")
    + matrix("T_Camera_B2", 3, 1, "0., 0., 2.")
)


def write_example(root: Path, intri: str = INTRI, extri: str = EXTRI) -> Path:
    """As ZJU-MoCap: cameras' folders at the top."""
    root.mkdir(exist_ok=True)
    (root / "intri.yml").write_text(intri)
    (root / "extri.yml").write_text(extri)
    for name in ("1", "Camera_B2"):
        save(root / name / "000000.jpg", pattern(40, 20, 0))
    return root


def test_an_example_by_hand(tmp_path: Path) -> None:
    """One camera 2 m from the origin, on the side of -x; one at z = -2."""
    write_example(tmp_path)
    first, second = read(tmp_path).views
    np.testing.assert_allclose(first.camera.centre, [-2, 0, 0], atol=1e-12)
    np.testing.assert_allclose(first.camera.forward, [1, 0, 0], atol=1e-12)
    assert first.lens.K.tolist() == [[50, 0, 20], [0, 51, 10], [0, 0, 1]]
    assert first.lens.coefficients.tolist() == [-0.1, 0.02, 0.001, -0.002, 0]
    assert second.camera.centre.tolist() == [0, 0, -2]
    assert second.lens is None


def test_labels_of_parts_are_opaque_and_opacity_stays(tmp_path: Path) -> None:
    write_example(tmp_path)
    labels = np.zeros((20, 40), np.uint8)
    labels[:, 20:] = 13
    save(tmp_path / "mask_cihp" / "1" / "000000.png", labels)
    save(tmp_path / "mask_cihp" / "Camera_B2" / "000000.png", labels * 10)
    capture = read(tmp_path)
    assert np.unique(capture.mattes[0, 0].opacity("")).tolist() == [0, 255]
    assert np.unique(capture.mattes[1, 0].opacity("")).tolist() == [0, 130]


def test_of_several_folders_of_masks_one_is_read_and_named(copied: Path) -> None:
    shutil.copytree(copied / "mask", copied / "mask_cihp")
    (said,) = map(str, read(copied).left_out)
    assert said == "note: masks are those of the folder mask; mask_cihp are not read"


def test_a_camera_without_pictures_and_one_without_calibration_are_left_out(copied: Path) -> None:
    (copied / "images" / "A001").rename(copied / "images" / "extra")
    kinds = {(one.kind, one.camera) for one in read(copied).left_out}
    assert kinds == {("no_images", "A001"), ("uncalibrated", "extra")}


BAD = [
    ("no K", INTRI.replace("K_1:", "K_7:"), EXTRI, "a key is missing", "K_1"),
    ("no rotation", INTRI, EXTRI.replace("R_1:", "R_7:"), "a key is missing", "R_1"),
    ("no translation", INTRI, EXTRI.replace("T_1:", "T_7:"), "a key is missing", "T_1"),
    ("cut off", INTRI, EXTRI[:130], "", "extri.yml"),
    ("too few numbers", INTRI, EXTRI.replace("2.]", "]", 1), "not a matrix", "T_1"),
    ("not finite", INTRI.replace("51.,", ".nan,"), EXTRI, "not a number", "K_Camera_B2"),
    ("turned numbers", INTRI, EXTRI.replace("rows: 3\n  cols: 1", "rows: 2\n  cols: 2", 1), "not a matrix", "R_1"),
    ("twice", INTRI.replace("Camera_B2", "1"), EXTRI, "", "intri.yml"),
    ("no names", "%YAML:1.0\n---\n", EXTRI, "not OpenCV's YAML", "intri.yml"),
    ("mirrored", INTRI, EXTRI.replace("[1., 0., 0., 0., 1.", "[-1., 0., 0., 0., 1."), "not a rotation", "Camera_B2"),
    ("turned pictures", INTRI.replace("H_1: 20", "H_1: 80"), EXTRI, "another shape", "camera 1"),
]


@pytest.mark.parametrize(("intri", "extri", "message", "word"), [row[1:] for row in BAD], ids=[row[0] for row in BAD])
def test_what_is_wrong_with_the_calibration_is_said(
    tmp_path: Path, intri: str, extri: str, message: str, word: str
) -> None:
    read.refused(write_example(tmp_path, intri, extri), message, word)


def test_neither_pictures_nor_videos_is_said(tmp_path: Path) -> None:
    write_calibration(tmp_path)
    (tmp_path / "annots.npy").touch()
    read.refused(tmp_path, "neither pictures nor videos", "annots.npy is a pickle")
