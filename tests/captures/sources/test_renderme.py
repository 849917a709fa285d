"""RenderMe-360: the actor filmed into .smc files, an example by hand, and files that lack something."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest

from facefolds_core.captures.sources import renderme
from facefolds_core.errors import UserError
from tests.captures.fixtures import encoded, pattern
from tests.filmed import Reader, check_same, film, scene_of

read = Reader("renderme")

NAMES = ("00", "01", "02", "03", "04")


def stored(image: np.ndarray, kind: str = "JPEG") -> np.ndarray:
    options = {"quality": 100, "subsampling": 0} if kind == "JPEG" else {}
    return np.frombuffer(encoded(image, kind, **options), np.uint8)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The film as the two files of a performance; masks are coloured, as the dataset's are."""
    folder, truth = tmp_path_factory.mktemp("renderme"), film()
    with h5py.File(folder / "0026_e0_raw.smc", "w") as raw, h5py.File(folder / "0026_e0_anno.smc", "w") as anno:
        for c, (name, camera) in enumerate(zip(NAMES, truth.cameras, strict=True)):
            c2w = np.eye(4)
            c2w[:3, :3], c2w[:3, 3] = camera.rotation.T, camera.centre / 1000
            K = camera.K - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
            for key, value in (("K", K), ("D", np.zeros(5)), ("RT", c2w)):
                anno[f"Calibration/{name}/{key}"] = value
            for k in range(truth.frames):
                raw[f"Camera/{name}/color/{k}"] = stored(truth.images[c, k])
                mask = np.zeros((*truth.mattes[c, k].shape, 3), np.uint8)
                mask[..., 1] = truth.mattes[c, k]
                anno[f"Camera/{name}/mask/{k}"] = stored(mask, "PNG")
        raw["Camera"].attrs["resolution"] = anno["Camera"].attrs["resolution"] = [64, 48]
    return folder


def test_the_filmed_actor_comes_back(filmed: Path, tmp_path: Path) -> None:
    scene = scene_of(filmed, "renderme", tmp_path / "scene", NAMES)
    check_same(scene, film(), dict(zip(NAMES, film().names, strict=True)), lossless=False, mattes="all")


def test_an_example_by_hand(tmp_path: Path) -> None:
    """One file with everything; a camera 2 m on the left of the origin, looking at it along +x; frame 10 after 9."""
    with h5py.File(tmp_path / "0001_s1_all.smc", "w") as smc:
        smc["Calibration/07/K"] = [[50.0, 0, 19.5], [0, 50, 9.5], [0, 0, 1]]
        smc["Calibration/07/D"] = [[0.1, 0.02, 0.001, -0.002, 0]]
        smc["Calibration/07/RT"] = [[0.0, 0, 1, -2], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]
        for frame in ("9", "10"):
            smc[f"Camera/07/color/{frame}"] = stored(pattern(40, 20, 0))
    capture = read(tmp_path / "0001_s1_all.smc")
    (view,) = capture.views
    assert view.camera.centre.tolist() == [-2, 0, 0]
    assert view.camera.forward.tolist() == [1, 0, 0]
    assert view.lens.K[:2, 2].tolist() == [20, 10]
    assert view.lens.coefficients.tolist() == [0.1, 0.02, 0.001, -0.002, 0]
    assert capture.frame_ids == ("9", "10")


@pytest.mark.parametrize("beside", [True, False])
def test_annotations_are_found_beside_the_pictures_and_in_the_datasets_folders(
    filmed: Path, tmp_path: Path, beside: bool
) -> None:
    raw, anno = tmp_path / "raw" / "0026", tmp_path / ("raw" if beside else "anno") / "0026"
    raw.mkdir(parents=True)
    anno.mkdir(parents=True, exist_ok=True)
    shutil.copy(filmed / "0026_e0_raw.smc", raw)
    shutil.copy(filmed / "0026_e0_anno.smc", anno)
    capture = read(raw / "0026_e0_raw.smc")
    assert (len(capture.views), len(capture.mattes)) == (5, 15)


def test_smaller_pictures_than_the_calibrations_scale_k(copied: Path) -> None:
    with h5py.File(copied / "0026_e0_anno.smc", "a") as smc:
        smc["Camera"].attrs["resolution"] = [128, 96]
    capture = read(copied)
    assert capture.views[0].camera.K[0, 0] == pytest.approx(film().cameras[0].K[0, 0] / 2)
    assert [one.kind for one in capture.left_out] == ["k_is_scaled"]


def test_performances_are_chosen_by_segment(copied: Path) -> None:
    for kind in ("raw", "anno"):
        shutil.copy(copied / f"0026_e0_{kind}.smc", copied / f"0026_s1_all_{kind}.smc")
    read.refused(copied, "several performances", "e0, s1_all")
    assert len(read(copied, segment="s1_all").views) == 5
    read.refused(copied, "no such performance", segment="e7")
    assert renderme.recognise(copied).keys == {"segment": "e0"}


BAD = [
    ("no calibration", "Calibration", None, "no calibration", "_anno.smc"),
    ("no RT", "Calibration/01/RT", None, "no such numbers", "Calibration/01/RT"),
    ("odd K", "Calibration/01/K", np.eye(4), "no such numbers", "(4, 4)"),
    ("not finite", "Calibration/01/K", np.full((3, 3), np.nan), "not a number", "Calibration/01/K"),
    ("no rotation", "Calibration/01/RT", np.eye(4) * [2, 2, 2, 1], "not a rotation", "Calibration/01"),
    ("text", "Calibration/01/D", "none", "no such numbers", "Calibration/01/D"),
]


@pytest.mark.parametrize(("key", "value", "message", "word"), [case[1:] for case in BAD], ids=[c[0] for c in BAD])
def test_what_is_wrong_in_a_file_is_said(copied: Path, key: str, value: object, message: str, word: str) -> None:
    with h5py.File(copied / "0026_e0_anno.smc", "a") as smc:
        del smc[key]
        if value is not None:
            smc[key] = value
    read.refused(copied, message, word)


def test_a_file_cut_off_and_a_folder_without_any_are_refused(filmed: Path, tmp_path: Path) -> None:
    read.refused(tmp_path, "no performances", "an .smc file")
    data = (filmed / "0026_e0_anno.smc").read_bytes()
    (tmp_path / "0026_e0_anno.smc").write_bytes(data[: len(data) // 2])
    read.refused(tmp_path, "damaged HDF5")


@pytest.mark.parametrize("name", ["0026_e0_raw.smc", "0026_e0_anno.smc"])
def test_damage_anywhere_in_a_file_is_the_users(filmed: Path, tmp_path: Path, name: str) -> None:
    data = (filmed / name).read_bytes()
    for start in range(0, len(data), len(data) // 16):
        root = Path(shutil.copytree(filmed, tmp_path / str(start)))  # HDF5 knows a file again that it has open
        (root / name).write_bytes(data[:start] + bytes(1000) + data[start + 1000 :])
        with suppress(UserError):
            read(root)


def test_a_camera_without_pictures_is_left_out_and_a_damaged_picture_refused(copied: Path, tmp_path: Path) -> None:
    with h5py.File(copied / "0026_e0_raw.smc", "a") as smc:
        del smc["Camera/03/color"]
        del smc["Camera/01/color/1"]
        smc["Camera/01/color/1"] = np.zeros(50, np.uint8)
    assert [str(one) for one in read(copied).left_out] == ["camera 03: calibrated, but has no pictures"]
    with pytest.raises(UserError, match="cannot read an image") as caught:
        scene_of(copied, "renderme", tmp_path / "scene", NAMES)
    assert "camera 01, frame 1" in str(caught.value)
