"""COLMAP: the actor filmed into models of both kinds, films and stills, an example by hand, damaged files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.captures.sources import colmap
from facefolds_core.geometry.cameras import Camera
from tests.captures.fixtures import pattern, save
from tests.filmed import Reader, check_same, film, moved, save_pictures, scene_of

read = Reader("colmap")

Array = NDArray[np.float64]
NUMBERS = {name: number for number, (name, _) in colmap.MODELS.items()}


def quaternion(R: Array) -> list[float]:
    """w, x, y, z of a rotation by less than half a turn."""
    w = np.sqrt(max(0.0, 1 + np.trace(R))) / 2
    return [w, *(np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)).tolist()]


class Model:
    """A model to write."""

    def __init__(self) -> None:
        self.cameras: list[tuple[int, str, int, int, list[float]]] = []
        self.images: list[tuple[list[float], int, str]] = []

    def add(self, camera: Camera, name: str, lens: str = "PINHOLE", values: list[float] | None = None) -> None:
        K = camera.K
        number = len(self.cameras) + 1
        given = [K[0, 0], K[1, 1], K[0, 2], K[1, 2]] if values is None else values
        self.cameras.append((number, lens, camera.width, camera.height, given))
        self.images.append(([*quaternion(camera.rotation), *camera.w2c[:, 3].tolist()], number, name))

    def write(self, folder: Path, kind: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        if kind == "txt":
            lines = [f"{n} {m} {w} {h} " + " ".join(map(repr, map(float, v))) for n, m, w, h, v in self.cameras]
            (folder / "cameras.txt").write_text("# Camera list\n" + "\n".join(lines) + "\n")
            rows = [
                f"{i} " + " ".join(map(repr, map(float, pose))) + f" {camera} {name}\n{'1.5 2.5 -1' if i % 2 else ''}\n"
                for i, (pose, camera, name) in enumerate(self.images, 1)
            ]
            (folder / "images.txt").write_text("# Image list\n" + "".join(rows))
            return
        data = struct.pack("<Q", len(self.cameras))
        for n, m, w, h, v in self.cameras:
            data += struct.pack("<iiQQ", n, NUMBERS[m], w, h) + struct.pack(f"<{len(v)}d", *v)
        (folder / "cameras.bin").write_bytes(data)
        data = struct.pack("<Q", len(self.images))
        for i, (pose, camera, name) in enumerate(self.images, 1):
            data += struct.pack("<i7di", i, *pose, camera) + name.encode() + b"\0"
            data += struct.pack("<Q2ddq", 1, 1.5, 2.5, 0.0, -1)[: 8 + 24]
        (folder / "images.bin").write_bytes(data)


def comes_back(root: Path, tolerance: float = 1e-6) -> None:
    """AssertionError unless the film does, whole."""
    save_pictures(root / "images", film().names, film().images)
    check_same(scene_of(root, "colmap", root / "scene", film().names), film(), tolerance=tolerance)
    assert read(root).left_out == ()


@pytest.mark.parametrize("kind", ["txt", "bin"])
@pytest.mark.parametrize("named", ["{}.png", "{}/000001.png"])
def test_the_filmed_actor_comes_back_from_one_registered_picture_a_camera(
    tmp_path: Path, kind: str, named: str
) -> None:
    model = Model()
    for camera in film().cameras:
        model.add(camera, named.format(camera.name))
    model.write(tmp_path / "sparse" / "0", kind)
    comes_back(tmp_path)


def test_it_comes_back_from_pictures_that_were_all_registered(tmp_path: Path) -> None:
    """Each has a pose and a camera of its own; one picture was not registered."""
    model = Model()
    for c, camera in enumerate(film().cameras):
        for k in range(film().frames):
            if (c, k) != (1, 2):
                model.add(moved(camera, 1e-5, 10 * c + k), f"{camera.name}/{k:06d}.png")
    model.write(tmp_path / "sparse", "bin")
    comes_back(tmp_path, tolerance=1e-4)


@pytest.mark.parametrize("kind", ["txt", "bin"])
def test_a_still_of_the_actor_comes_back(tmp_path: Path, kind: str) -> None:
    truth = film(frames=1)
    model = Model()
    for c, camera in enumerate(truth.cameras):
        save(tmp_path / "images" / f"{camera.name}.png", truth.images[c, 0])
        model.add(camera, f"{camera.name}.png")
    model.write(tmp_path, kind)
    check_same(scene_of(tmp_path, "colmap", tmp_path / "scene", truth.names), truth)


def test_an_example_by_hand(tmp_path: Path) -> None:
    """Turned by 90 degrees about y: world x lies along -z of the camera, which stands 2 before the origin."""
    (tmp_path / "sparse").mkdir()
    (tmp_path / "sparse" / "cameras.txt").write_text(
        "# number, model, width, height\n\n3 SIMPLE_RADIAL 40 20 50 20.5 9.5 -0.1\n"
    )
    (tmp_path / "sparse" / "images.txt").write_text(
        "# two lines an image\n7 0.70710678118 0 0.70710678118 0 0 0 2 3 left eye.png\n\n"
        "9 1 0 0 0 0 0 2 3 middle.png\n10.5 3.25 12 7.5 3 -1\n"
    )
    for name in ("left eye", "middle"):
        save(tmp_path / "images" / f"{name}.png", pattern(40, 20, 0))
    capture = read(tmp_path)
    first, second = capture.views
    assert (first.name, second.name) == ("left eye", "middle")
    np.testing.assert_allclose(first.camera.centre, [2, 0, 0], atol=1e-9)
    np.testing.assert_allclose(first.camera.forward, [-1, 0, 0], atol=1e-9)
    assert second.camera.centre.tolist() == [0, 0, -2]
    assert second.lens.K.tolist() == [[50, 0, 20.5], [0, 50, 9.5], [0, 0, 1]]
    assert second.lens.coefficients.tolist() == [-0.1, 0, 0, 0, 0]
    assert capture.fps == 0


LENSES: list[tuple[str, list[float], list[float] | None, bool]] = [
    ("SIMPLE_PINHOLE", [60, 20, 10], None, False),
    ("PINHOLE", [60, 60, 20, 10], None, False),
    ("RADIAL", [60, 20, 10, -0.1, 0.02], [-0.1, 0.02, 0, 0, 0], False),
    ("OPENCV", [60, 60, 20, 10, -0.1, 0.02, 0.001, 0.002], [-0.1, 0.02, 0.001, 0.002, 0], False),
    ("OPENCV_FISHEYE", [60, 60, 20, 10, 0.03, 0.02, 0.01, 0.005], [0.03, 0.02, 0.01, 0.005], True),
    ("SIMPLE_RADIAL_FISHEYE", [60, 20, 10, 0.03], [0.03, 0, 0, 0], True),
    ("RADIAL_FISHEYE", [60, 20, 10, 0.03, 0.01], [0.03, 0.01, 0, 0], True),
    ("FULL_OPENCV", [60, 60, 20, 10, *[0.01 * i for i in range(1, 9)]], [0.01 * i for i in range(1, 9)], False),
]


@pytest.mark.parametrize(("model", "values", "expected", "fisheye"), LENSES, ids=[lens[0] for lens in LENSES])
def test_camera_models(
    tmp_path: Path, model: str, values: list[float], expected: list[float] | None, fisheye: bool
) -> None:
    camera = Camera("a", np.eye(3), np.eye(3, 4), 40, 20)
    written = Model()
    written.add(camera, "a.png", model, values)
    written.write(tmp_path, "bin")
    save(tmp_path / "images" / "a.png", pattern(40, 20, 0))
    (view,) = read(tmp_path).views
    assert (view.lens or view.camera).K.tolist() == [[60, 0, 20], [0, 60, 10], [0, 0, 1]]
    assert (view.lens and view.lens.coefficients.tolist()) == expected
    assert bool(view.lens and view.lens.fisheye) == fisheye


def two(root: Path, kind: str) -> Path:
    model = Model()
    for name in ("a", "b"):
        save(root / "images" / f"{name}.png", pattern(40, 20, 0))
    model.add(Camera("a", np.diag([60.0, 60, 1]), np.eye(3, 4), 40, 20), "a.png")
    model.add(Camera("b", np.diag([60.0, 60, 1]), np.eye(3, 4) + np.eye(3, 4, 3), 40, 20), "b.png")
    model.write(root, kind)
    return root


TEXT: list[tuple[str, str, str, str, str, str]] = [
    ("model", "cameras.txt", "PINHOLE", "FOV", "model that is not read", "line 2"),
    ("too few values", "cameras.txt", " 0.0\n", "\n", "garbled camera", "line 2"),
    ("no number", "cameras.txt", "40 20", "forty 20", "garbled camera", "line 2"),
    ("not finite", "cameras.txt", "60.0", "inf", "garbled camera", "line 2"),
    ("no such camera", "images.txt", " 2 b.png", " 5 b.png", "camera that is not there", "line 4"),
    ("no rotation", "images.txt", "1 1.0", "1 0.0", "garbled pose", "line 2"),
    ("cut off", "images.txt", " 2 b.png\n\n", "", "garbled image", "line 4"),
    ("other size", "cameras.txt", "40 20", "40 40", "another shape", "a.png"),
    ("UTF-16", "cameras.txt", "", "", "another encoding", "UTF-16"),
]


@pytest.mark.parametrize(("file", "old", "new", "message", "word"), [row[1:] for row in TEXT], ids=[r[0] for r in TEXT])
def test_what_is_wrong_in_a_text_model_is_said(
    tmp_path: Path, file: str, old: str, new: str, message: str, word: str
) -> None:
    path = two(tmp_path, "txt") / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8" if old else "utf-16")
    read.refused(tmp_path, message, word)


@pytest.mark.parametrize("name", ["cameras.bin", "images.bin"])
def test_a_binary_model_cut_anywhere_is_refused(tmp_path: Path, name: str) -> None:
    path = two(tmp_path, "bin") / name
    data = path.read_bytes()
    for end in range(0, len(data), 7):
        path.write_bytes(data[:end])
        read.refused(tmp_path, "cut off")


def test_pictures_that_do_not_exist_are_left_out_and_said(tmp_path: Path) -> None:
    two(tmp_path, "bin")
    (tmp_path / "images" / "b.png").unlink()
    assert str(read(tmp_path).left_out[0]).endswith("no image b.png")
    model = Model()
    for name in ("../images/a.png", "/etc/passwd"):
        model.add(Camera("a", np.diag([60.0, 60, 1]), np.eye(3, 4), 40, 20), name)
    model.write(tmp_path, "bin")
    read.refused(tmp_path, "none of the registered pictures")


def test_other_models_are_named_and_none_is_refused(tmp_path: Path) -> None:
    read.refused(tmp_path, "no COLMAP model")
    two(tmp_path, "bin")
    for number in "012":
        two(tmp_path / "sparse" / number, "txt")
    (tmp_path / "cameras.bin").unlink()
    assert "(1, 2)" in str(read(tmp_path).left_out[-1])
    assert colmap.recognise(tmp_path) and not colmap.recognise(tmp_path / "images")
