"""Bad captures: each gives one message that names file, place and remedy, and leaves nothing behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.config.params_file import Params, write_configs
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.params import Subject
from facefolds_core.pipeline.normalize import normalize
from tests.captures.fixtures import (
    SEGMENT,
    VERTICES,
    MultifaceCapture,
    pattern,
    save,
    write_multiface,
    write_obj,
    write_transforms,
)

Damage = Callable[[MultifaceCapture], object]


def run(root: Path, source: str, sections: dict[str, dict[str, Any]] | None = None, **keys: Any) -> SubjectFolders:
    """Normalise the capture in `root` as a subject with these keys."""
    subject = Subject(source=source, path=str(root), **{"holdout": ("400003",), **keys})
    folders = SubjectFolders(root.parent / "data" / "head")
    params = Params(subjects={"head": subject}, sections=sections or {}, path="params.yaml")
    write_configs(params, "head", folders.config)
    print(normalize(folders))
    return folders


def refused(root: Path, source: str, sections: dict[str, dict[str, Any]] | None = None, **keys: Any) -> UserError:
    """The error that it gives; checks that no scene, not even a part of one, was left."""
    with pytest.raises(UserError) as caught:
        run(root, source, sections, **keys)
    assert not list((root.parent / "data").glob("head/*"))
    assert caught.value.remedy
    return caught.value


def replace_line(path: Path, number: int, text: str) -> None:
    lines = path.read_text().splitlines()
    lines[number - 1] = text
    path.write_text("\n".join(lines))


def krt(number: int, text: str) -> Damage:
    return lambda c: replace_line(c.krt, number, text)


def cut(path: Path, keep: int) -> None:
    path.write_bytes(path.read_bytes()[:keep])


def mesh(suffix: str, change: Callable[[Path], object]) -> Damage:
    return lambda c: change(c.mesh("000003", suffix))


def pose(number: int, text: str) -> Damage:
    return mesh("_transform.txt", lambda p: replace_line(p, number, text))


def vertices(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    """Other vertices in all frames."""
    return lambda c: [change(VERTICES).astype("<f4").tofile(c.mesh(frame, ".bin")) for frame in c.frames]


def half_a_camera(c: MultifaceCapture) -> None:
    c.krt.write_text("\n".join(c.krt.read_text().splitlines()[:12]))


def unknown_size(c: MultifaceCapture) -> None:
    for first in range(2, 9 * len(c.cameras), 9):
        replace_line(c.krt, first, "900 0 200")
        replace_line(c.krt, first + 1, "0 900 300")


def other_count(c: MultifaceCapture) -> None:
    for frame in c.frames:
        c.mesh(frame, ".bin").unlink()
    write_obj(c.mesh("000009", ".obj"), np.concatenate([VERTICES, VERTICES]))


def all_incomplete(c: MultifaceCapture) -> None:
    for camera, frame in zip(("400001", "400002", "400003"), c.frames, strict=True):
        c.image(camera, frame).unlink()


def second_segment(c: MultifaceCapture) -> None:
    (c.root / "images" / "E002_Swallow").mkdir()


def folder_to_file(name: str) -> Damage:
    def change(c: MultifaceCapture) -> None:
        (c.root / name).rename(c.root.parent / "away")
        (c.root / name).write_text("x")

    return change


def as_utf_16(name: str) -> Damage:
    return lambda c: (c.root / name).write_text((c.root / name).read_text(), encoding="utf-16")


MESHES = f"tracked_mesh/{SEGMENT}"
TRANSFORM = f"{MESHES}/000003_transform.txt"
MASK = f"masks/{SEGMENT}/400003/000003.png"
BAD: dict[str, tuple[Damage, str, str, str]] = {
    # name: what is done, the message, the file, a word of the place and all else that is said
    "KRT: word": (krt(3, "0 banana 30"), "garbled KRT", "KRT", "line 3 (camera 400001)"),
    "KRT: short row": (krt(6, "1 0 0"), "garbled KRT", "KRT", "line 6 (camera 400001)"),
    "KRT: nan": (krt(6, "nan 0 0 5"), "garbled KRT", "KRT", "line 6 (camera 400001)"),
    "KRT: a number that only Python reads": (krt(2, "1_50 0 22"), "garbled KRT", "KRT", "line 2 (camera 400001)"),
    "KRT: huge": (krt(2, "150 0 1e12"), "garbled KRT", "KRT", "line 2 (camera 400001)"),
    "KRT: digits of another script": (krt(2, "150 0 \u0661\u0662_"), "garbled KRT", "KRT", "line 2 (camera 400001)"),
    "KRT: name": (krt(1, "4000 01"), "garbled KRT", "KRT", "line 1"),
    "KRT: twice": (krt(10, "400001"), "a camera appears twice", "KRT", "lines 10 to 17"),
    "KRT: singular K": (krt(2, "0 0 22"), "singular", "KRT", "camera 400001, lines 1 to 8"),
    "KRT: singular R": (krt(7, "0 0 0 1"), "not a rotation", "KRT", "camera 400001, lines 1 to 8"),
    "KRT: truncated": (half_a_camera, "KRT is truncated", "KRT", "line 12, the last one (camera 400002)"),
    "KRT: missing": (lambda c: c.krt.unlink(), "file not found", "KRT", "which holds KRT"),
    "KRT: empty": (lambda c: c.krt.write_text(""), "KRT is empty", "KRT", "at least one camera"),
    "KRT: binary": (lambda c: c.krt.write_bytes(b"\xff\xfe\x00"), "", "KRT", "UTF-16"),
    "KRT: of unknown size": (unknown_size, "cannot tell which image size", "KRT", "set `krt_size"),
    "KRT: UTF-16": (as_utf_16("KRT"), "", "KRT", "UTF-16"),
    "frame list: UTF-16": (as_utf_16("frame_list.txt"), "", "frame_list.txt", "UTF-16"),
    "mesh: UTF-16": (as_utf_16(f"{MESHES}/000003.obj"), "", "000003.obj", "UTF-16"),
    "image: size": (
        lambda c: save(c.image("400004", "000009"), pattern(41, 64, 0)),
        "images of different sizes",
        "400004/000009.png",
        "41 x 64",
    ),
    "mask: size": (lambda c: save(c.root / MASK, np.zeros((32, 20), np.uint8)), "different sizes", MASK, "20 x 32"),
    "images: no frame complete": (all_incomplete, "no frame has an image from every camera", "", "400002 lacks 1"),
    "images: a file": (folder_to_file("images"), "not a folder", "images", "a file"),
    "images: two segments": (second_segment, "none is chosen", "images", f"one of {SEGMENT}, E002_Swallow"),
    "images of a segment: a file": (folder_to_file(f"images/{SEGMENT}"), "no segments", "images", "download some"),
    "meshes: a file": (folder_to_file(MESHES), "not a folder", MESHES, "a file"),
    "mesh: bytes": (mesh(".bin", lambda p: cut(p, 90)), "wrong length", "000003.bin", "90 bytes"),
    "mesh: vertices": (mesh(".bin", lambda p: cut(p, 84)), "wrong length", "000003.bin", "84 bytes"),
    "mesh: empty": (mesh(".bin", lambda p: cut(p, 0)), "wrong length", "000003.bin", "0 bytes"),
    "mesh: nan": (vertices(lambda v: v * np.nan), "damaged tracked mesh", "000003.bin", "8 of them not finite"),
    "mesh: zeros": (vertices(lambda v: 0 * v), "damaged tracked mesh", "000003.bin", "8 of 8 exactly at 0"),
    "mesh: zeros at the end": (
        vertices(lambda v: np.where(np.arange(8)[:, None] < 5, v, 0)),
        "damaged tracked mesh",
        "000003.bin",
        "3 of 8 exactly at 0",
    ),
    "mesh: one point": (vertices(lambda v: 0 * v + 3), "in one point or on one line", "000003.bin", "a head"),
    "mesh: a line": (vertices(lambda v: v[:, :1] * [1, 2, 3] + 1), "on one line", "000003.bin", "a head"),
    "mesh: huge": (vertices(lambda v: v * 1e12), "damaged tracked mesh", "000003.bin", "8 of them not finite or above"),
    "mesh: in metres": (vertices(lambda v: v / 1e5), "absurdly small or large", "", "frame 000003"),
    "mesh: word": (mesh(".obj", lambda p: replace_line(p, 3, "v 1 two 3")), "garbled mesh", "000003.obj", "line 3"),
    "mesh: short": (mesh(".obj", lambda p: replace_line(p, 3, "v 1 2")), "garbled mesh", "000003.obj", "line 3"),
    "mesh: face": (mesh(".obj", lambda p: replace_line(p, 9, "f 1 2 99")), "garbled mesh", "000003.obj", "1 to 99"),
    "mesh: no faces": (mesh(".obj", lambda p: p.write_text("v 1 2 3\n" * 8)), "garbled mesh", ".obj", "0 triangles"),
    "mesh: binary": (mesh(".obj", lambda p: p.write_bytes(b"\xff\x00\xfe")), "not a text file", "000003.obj", ""),
    "mesh: another count": (other_count, "damaged tracked mesh", "000009.obj", "16 vertices"),
    "pose: word": (pose(2, "0 1 x 0"), "garbled head pose", TRANSFORM, "3 rows of 4 numbers"),
    "pose: short": (pose(2, ""), "garbled head pose", TRANSFORM, "3 rows of 4 numbers"),
    "pose: nan": (pose(2, "0 nan 0 0"), "not finite", TRANSFORM, "nan"),
    "pose: 1e300": (pose(1, "1 0 0 1e300"), "beyond sense", TRANSFORM, "1e+300"),
    "pose: singular": (pose(1, "0 0 0 1"), "not a rotation", TRANSFORM, "det R = 0"),
}


@pytest.mark.parametrize(("damage", "message", "file", "words"), BAD.values(), ids=BAD)
def test_a_bad_multiface_capture(tmp_path: Path, damage: Damage, message: str, file: str, words: str) -> None:
    damage(write_multiface(tmp_path / "c"))
    error = refused(tmp_path / "c", "multiface")
    assert (message in error.message, words in str(error)) == (True, True), error
    assert str(error.file).endswith(file or "/c")


IMAGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "truncated": (lambda p: cut(p, 3000), "a damaged image"),
    "header only": (lambda p: cut(p, 40), "cannot read an image"),
    "empty": (lambda p: cut(p, 0), "cannot read an image"),
    "text": (lambda p: p.write_text("not found (404)"), "cannot read an image"),
}


@pytest.mark.parametrize("source", ["multiface", "transforms"])
@pytest.mark.parametrize(("damage", "message"), IMAGES.values(), ids=IMAGES)
def test_bad_image(tmp_path: Path, source: str, damage: Callable[[Path], object], message: str) -> None:
    if source == "multiface":
        path, place = write_multiface(tmp_path / "c").image("400004", "000006"), "camera 400004, frame 000006"
    else:
        path, place = write_transforms(tmp_path / "c")[0].parent / "images" / "400004.png", "camera 400004"
    damage(path)
    error = refused(tmp_path / "c", source, front=None)
    assert (error.message, error.file) == (message, path)
    assert str(error.place).startswith(place)


def test_a_culled_camera_may_have_another_size(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    for frame in made.frames:
        save(made.image("400001", frame), pattern(80, 128, 0))
    folders = run(tmp_path / "c", "multiface", {"normalize": {"max_azimuth": 45}})
    assert (folders.scene / "frames.arrow").exists()


Edit = dict[str, Any]
CHOICES: dict[str, tuple[Edit, Edit, str, str]] = {
    # name: keys of the subject, of `normalize`, the message, words of all that is said
    "held out, unknown": ({"holdout": ("400009",)}, {}, "a held-out camera is not there", "400003"),
    "held out, culled": ({"holdout": ("400001",)}, {"max_azimuth": 45}, "held-out camera is not there", "culled, elev"),
    "nothing left": ({"holdout": ("400003",)}, {"max_azimuth": 5}, "no camera is left for training", "400003"),
    "segment": ({"segment": "E999"}, {}, "no such segment", SEGMENT),
    "frames beyond": ({"frames": {"start": 7}}, {}, "the range of frames is empty", "000009"),
    "frame unknown": ({"frames": ("000004",)}, {}, "frames of `subjects`", "000009"),
    "slow": ({"fps": 0.05}, {}, "a frame rate that no capture has", "correct `fps`"),
    "fast": ({"fps": 2000}, {}, "a frame rate that no capture has", "correct `fps`"),
}


@pytest.mark.parametrize(("keys", "params", "message", "words"), CHOICES.values(), ids=CHOICES)
def test_choices_that_the_capture_does_not_have(
    tmp_path: Path, keys: Edit, params: Edit, message: str, words: str
) -> None:
    write_multiface(tmp_path / "c")
    error = refused(tmp_path / "c", "multiface", {"normalize": params}, **keys)
    assert (message in error.message, words in str(error)) == (True, True)


def test_all_cameras_culled_says_their_angles(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c", turn=40)  # the mean head looks past all cameras
    error = refused(tmp_path / "c", "multiface", {"normalize": {"max_azimuth": 5}})
    assert error.message == "all cameras are culled"
    assert "400001 (0, -100)" in str(error.found)


def test_a_scene_that_is_there_survives_a_failed_run(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    folders = run(tmp_path / "c", "multiface")
    before = (folders.scene / "scene.json").read_text()
    cut(made.image("400005", "000009"), 3000)
    with pytest.raises(UserError, match="a damaged image"):
        run(tmp_path / "c", "multiface")
    assert (folders.scene / "scene.json").read_text() == before
    assert sorted(path.name for path in folders.root.iterdir()) == ["scene"]


def test_it_says_what_was_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = write_multiface(tmp_path / "c")
    made.image("400002", "000006").unlink()
    run(tmp_path / "c", "multiface")
    assert "frame 000006: no image from 400002" in capsys.readouterr().out
