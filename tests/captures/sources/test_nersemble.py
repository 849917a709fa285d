"""NeRSemble's layouts: the actor filmed into them, an example by hand, and what is wrong with a download."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.captures.fixtures import pattern, save
from tests.filmed import Film, Reader, check_same, film, save_jpeg, save_video, scene_of

read = Reader("nersemble")

SEQUENCE = "EXP-2-eyes"
WIDTH, HEIGHT = 44, 64  # as upright as 2200 x 3208, to a quarter of a percent


def truth() -> Film:
    return film(width=WIDTH, height=HEIGHT)


def shared_k(actor: Film) -> list[list[float]]:
    """K of all cameras, for the rig's size."""
    return (np.diag([2200 / WIDTH, 3208 / HEIGHT, 1.0]) @ actor.cameras[0].K).tolist()


def poses(actor: Film) -> dict[str, Any]:
    return {camera.name: [*camera.w2c.tolist(), [0, 0, 0, 1]] for camera in actor.cameras}


def write_json(path: Path, value: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(value))


def as_version_2(root: Path, per_camera: bool = False, alpha: bool = False) -> None:
    actor = truth()
    inner = {camera.name: camera.K.tolist() for camera in actor.cameras} if per_camera else shared_k(actor)
    write_json(root / "calibration" / "camera_params.json", {"world_2_cam": poses(actor), "intrinsics": inner})
    folder = root / "sequences" / SEQUENCE
    for c, name in enumerate(actor.names):
        save_video(folder / "images" / f"cam_{name}.mp4", actor.images[c], actor.fps)
        if alpha:
            grey = np.repeat(actor.mattes[c][..., None], 3, -1)
            save_video(folder / "alpha_maps" / f"cam_{name}.mp4", grey, actor.fps)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("nersemble") / "018"
    as_version_2(root)
    for c, name in enumerate(truth().names):
        save_jpeg(root / "sequences" / "BACKGROUND" / f"image_{name}.jpg", truth().plates[c])
    return root


def test_the_filmed_actor_comes_back(filmed: Path, tmp_path: Path) -> None:
    scene = scene_of(filmed, "nersemble", tmp_path / "scene", truth().names)
    check_same(scene, truth())
    plates = scene.open_plates()
    for c in range(len(truth().names)):
        error = float(np.mean((plates.image(c, 0).astype(float) - truth().plates[c]) ** 2))
        assert 10 * np.log10(255**2 / error) > 45


def test_so_it_does_from_the_benchmark_with_its_mattes(tmp_path: Path) -> None:
    root = tmp_path / "388"
    as_version_2(root, per_camera=True, alpha=True)
    check_same(scene_of(root, "nersemble", tmp_path / "scene", truth().names), truth(), mattes="all")


@pytest.mark.parametrize(
    ("timesteps", "images"), [("timesteps", "images-2x"), ("timesteps", "images"), (".", "images-2x-73fps")]
)
def test_so_it_does_from_version_1(tmp_path: Path, timesteps: str, images: str) -> None:
    root, actor = tmp_path / "018", truth()
    write_json(root / "camera_params.json", {"world_2_cam": poses(actor), "intrinsics": shared_k(actor)})
    for k in range(actor.frames):
        moment = root / "sequences" / SEQUENCE / timesteps / f"frame_{3 * k:05d}"
        for c, name in enumerate(actor.names):
            save_jpeg(moment / images / f"cam_{name}.jpg", actor.images[c, k])
            save(moment / "alpha_map" / f"cam_{name}.png", actor.mattes[c, k])
    capture = read(root)
    assert (capture.frame_ids, capture.fps) == (("00000", "00003", "00006"), pytest.approx(73 / 3))
    scene = scene_of(root, "nersemble", tmp_path / "scene", actor.names, fps=30.0)
    check_same(scene, actor, lossless=False, mattes="all")


def write_example(root: Path) -> None:
    """Two cameras, a picture each, numbers by hand: the second stands 2 to the right of the world's origin."""
    write_json(
        root / "camera_params.json",
        {
            "world_2_cam": {
                "222200037": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]],
                "220700191": [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 2], [0, 0, 0, 1]],
            },
            "intrinsics": [[8000, 0, 1100], [0, 8020, 1604], [0, 0, 1]],
        },
    )
    for serial in ("222200037", "220700191"):
        folder = root / "sequences" / "FREE" / "timesteps" / "frame_00000" / "images-2x"
        save(folder / f"cam_{serial}.png", pattern(110, 160, 0))


def test_an_example_by_hand(tmp_path: Path) -> None:
    write_example(tmp_path)
    first, second = (view.camera for view in read(tmp_path).views)
    assert (first.name, first.width, first.height) == ("222200037", 110, 160)
    np.testing.assert_allclose(first.K, [[400, 0, 55], [0, 400, 80], [0, 0, 1]])
    assert second.centre == pytest.approx([2, 0, 0])
    assert second.forward == pytest.approx([-1, 0, 0])


def test_colours_are_corrected_in_linear_light(copied: Path, tmp_path: Path) -> None:
    halved = (0.5 * np.eye(3)).tolist()
    write_json(copied / "calibration" / "color_calibration.json", {truth().names[1]: halved})
    scene = scene_of(copied, "nersemble", tmp_path / "scene", truth().names)
    coded = truth().images[1, 0] / 255
    light = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4) / 2
    expected = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(scene.open_frames().image(1, 0) - expected).max() < 0.51
    assert np.array_equal(scene.open_frames().image(0, 0), truth().images[0, 0])
    assert "note: colours of 1 cameras are corrected by color_calibration.json" in map(str, scene.left_out)


def test_version_1_corrects_them_on_the_curve(tmp_path: Path) -> None:
    write_example(tmp_path)
    folder = tmp_path / "annotations" / "FREE" / "color_correction"
    folder.mkdir(parents=True)
    np.save(folder / "222200037.npy", np.array([[0, 1, 0, 0.1], [1, 0, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 1]]))
    colour, none = (view.colour for view in read(tmp_path).views)
    assert none is None and colour is not None and not colour.linear
    assert colour.matrix @ [0.2, 0.4, 0.6] + colour.offset == pytest.approx([0.5, 0.2, 0.3])


def test_of_several_sequences_one_must_be_chosen(copied: Path) -> None:
    (copied / "sequences" / "HAIR").mkdir()
    read.refused(copied, "several sequences", f"one of {SEQUENCE}, HAIR")
    assert len(read(copied, segment=SEQUENCE).frame_ids) == 3


def test_a_camera_with_fewer_frames_is_named(copied: Path) -> None:
    save_video(copied / "sequences" / SEQUENCE / "images" / "cam_A002.mp4", truth().images[2, :2], 30)
    read.refused(copied, "videos of different lengths", "camera A002")
    assert len(read(copied, frames={"stop": 2}).frame_ids) == 2


@pytest.mark.parametrize(
    ("change", "words", "place"),
    [
        ({"world_2_cam": {}}, "no calibration", None),
        ({"intrinsics": {"A000": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}, "cameras without intrinsics", "intrinsics"),
        ({"intrinsics": [[1, 2], [3, 4]]}, "a matrix of the wrong shape", "intrinsics, A000"),
        ({"world_2_cam": {"A000": [["x"] * 4] * 4}}, "not a number", "world_2_cam, A000"),
    ],
)
def test_a_garbled_calibration(copied: Path, change: dict[str, Any], words: str, place: str | None) -> None:
    path = copied / "calibration" / "camera_params.json"
    write_json(path, {**json.loads(path.read_text()), **change})
    read.refused(copied, words, path, place or "")


def test_a_correction_of_more_terms_is_refused(copied: Path) -> None:
    write_json(copied / "calibration" / "color_calibration.json", {"A000": [[1.0] * 7] * 3})
    read.refused(copied, "a matrix of the wrong shape")


def test_a_folder_without_calibration(tmp_path: Path) -> None:
    (tmp_path / "sequences" / SEQUENCE / "images").mkdir(parents=True)
    read.refused(tmp_path, "file not found", "participant's folder")
