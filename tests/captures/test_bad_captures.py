"""Bad captures: each gives one message that names file, place and remedy, and leaves nothing behind."""

from __future__ import annotations

import json
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
    HEAD_TO_WORLD,
    SEGMENT,
    VERTICES,
    MultifaceCapture,
    pattern,
    pose_text,
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


def cut(path: Path, keep: int) -> None:
    path.write_bytes(path.read_bytes()[:keep])


KRT: list[tuple[str, Damage, str, str]] = [
    ("word", lambda c: replace_line(c.krt, 3, "0 banana 30"), "garbled KRT", "line 3 (camera 400001)"),
    ("short row", lambda c: replace_line(c.krt, 6, "1 0 0"), "garbled KRT", "line 6 (camera 400001)"),
    ("nan", lambda c: replace_line(c.krt, 6, "nan 0 0 5"), "garbled KRT", "line 6 (camera 400001)"),
    ("name", lambda c: replace_line(c.krt, 1, "4000 01"), "garbled KRT", "line 1"),
    ("twice", lambda c: replace_line(c.krt, 10, "400001"), "a camera appears twice", "line 10"),
    ("singular K", lambda c: replace_line(c.krt, 2, "0 0 22"), "singular", "camera 400001, lines 1 to 8"),
    ("singular R", lambda c: replace_line(c.krt, 7, "0 0 0 1"), "not a rotation", "camera 400001, lines 1 to 8"),
    (
        "truncated",
        lambda c: c.krt.write_text("\n".join(c.krt.read_text().splitlines()[:12])),
        "KRT is truncated",
        "line 12, the last one (camera 400002)",
    ),
]


@pytest.mark.parametrize(("damage", "message", "place"), [row[1:] for row in KRT], ids=[row[0] for row in KRT])
def test_bad_krt(tmp_path: Path, damage: Damage, message: str, place: str) -> None:
    made = write_multiface(tmp_path / "c")
    damage(made)
    error = refused(tmp_path / "c", "multiface")
    assert (message in error.message, error.file, error.place) == (True, made.krt, place)


@pytest.mark.parametrize(
    "damage", [lambda c: c.krt.unlink(), lambda c: c.krt.write_text(""), lambda c: c.krt.write_bytes(b"\xff\xfe\x00")]
)
def test_missing_empty_or_binary_krt(tmp_path: Path, damage: Damage) -> None:
    made = write_multiface(tmp_path / "c")
    damage(made)
    assert refused(tmp_path / "c", "multiface").file == made.krt


def test_a_krt_of_unknown_size_asks_for_it(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    lines = made.krt.read_text().splitlines()
    for first in range(0, len(lines), 9):
        lines[first + 1], lines[first + 2] = "900 0 200", "0 900 300"
    made.krt.write_text("\n".join(lines))
    error = refused(tmp_path / "c", "multiface")
    assert "krt_size" in str(error.remedy)


IMAGES: list[tuple[str, Callable[[Path], object], str]] = [
    ("truncated", lambda p: cut(p, 3000), "a damaged image"),
    ("header only", lambda p: cut(p, 40), "cannot read an image"),
    ("empty", lambda p: cut(p, 0), "cannot read an image"),
    ("text", lambda p: p.write_text("not found (404)"), "cannot read an image"),
]


@pytest.mark.parametrize("source", ["multiface", "transforms"])
@pytest.mark.parametrize(("damage", "message"), [row[1:] for row in IMAGES], ids=[row[0] for row in IMAGES])
def test_bad_image(tmp_path: Path, source: str, damage: Callable[[Path], object], message: str) -> None:
    if source == "multiface":
        path = write_multiface(tmp_path / "c").image("400004", "000006")
        place = "camera 400004, frame 000006"
    else:
        write_transforms(tmp_path / "c")
        path, place = tmp_path / "c" / "images" / "400004.png", "camera 400004"
    damage(path)
    error = refused(tmp_path / "c", source, front=None)
    assert (error.message, error.file) == (message, path)
    assert str(error.place).startswith(place)


def test_images_of_different_sizes(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    save(made.image("400004", "000009"), pattern(41, 64, 0))
    error = refused(tmp_path / "c", "multiface")
    assert (error.message, error.place) == ("images of different sizes", "camera 400004, frame 000009")
    assert (str(error.expected)[:7], error.found) == ("40 x 64", "41 x 64")


def test_a_culled_camera_may_have_another_size(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    for frame in made.frames:
        save(made.image("400001", frame), pattern(80, 128, 0))
    folders = run(tmp_path / "c", "multiface", {"normalize": {"max_azimuth": 45}})
    assert (folders.scene / "frames.arrow").exists()


def test_a_mask_of_another_size(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c")
    mask = tmp_path / "c" / "masks" / SEGMENT / "400003" / "000003.png"
    save(mask, np.zeros((32, 20), np.uint8))
    assert refused(tmp_path / "c", "multiface").file == mask


MESHES: list[tuple[str, str, Callable[[Path], object], str]] = [
    ("bytes", ".bin", lambda p: cut(p, 90), "wrong length"),
    ("vertices", ".bin", lambda p: cut(p, 84), "wrong length"),
    ("empty", ".bin", lambda p: cut(p, 0), "wrong length"),
    ("nan", ".bin", lambda p: (VERTICES * np.nan).astype("<f4").tofile(p), "damaged tracked mesh"),
    ("word", ".obj", lambda p: replace_line(p, 3, "v 1 two 3"), "garbled mesh"),
    ("short", ".obj", lambda p: replace_line(p, 3, "v 1 2"), "garbled mesh"),
    ("face", ".obj", lambda p: replace_line(p, 9, "f 1 2 99"), "garbled mesh"),
    ("binary", ".obj", lambda p: p.write_bytes(b"\xff\x00\xfe"), "not a text file"),
    ("pose word", "_transform.txt", lambda p: replace_line(p, 2, "0 1 x 0"), "garbled head pose"),
    ("pose short", "_transform.txt", lambda p: replace_line(p, 2, ""), "garbled head pose"),
    ("pose nan", "_transform.txt", lambda p: replace_line(p, 2, "0 nan 0 0"), "not finite"),
    (
        "pose singular",
        "_transform.txt",
        lambda p: p.write_text(pose_text(0 * HEAD_TO_WORLD, np.ones(3))),
        "not a rotation",
    ),
]


@pytest.mark.parametrize(
    ("suffix", "damage", "message"), [row[1:] for row in MESHES], ids=[f"{row[1]} {row[0]}" for row in MESHES]
)
def test_bad_tracked_mesh(tmp_path: Path, suffix: str, damage: Callable[[Path], object], message: str) -> None:
    path = write_multiface(tmp_path / "c").mesh("000003", suffix)
    damage(path)
    error = refused(tmp_path / "c", "multiface")
    assert (message in error.message, error.file) == (True, path)


def test_a_mesh_that_changes_its_number_of_vertices(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    for frame in made.frames:
        made.mesh(frame, ".bin").unlink()
    write_obj(made.mesh("000009", ".obj"), np.concatenate([VERTICES, VERTICES]))
    assert refused(tmp_path / "c", "multiface").file == made.mesh("000009", ".obj")


Edit = dict[str, Any]
CHOICES: list[tuple[str, Edit, Edit, str, str]] = [
    ("held out, unknown", {"holdout": ("400009",)}, {}, "a held-out camera is not there", "400003"),
    (
        "held out, culled",
        {"holdout": ("400001",)},
        {"max_azimuth": 45},
        "a held-out camera is not there",
        "culled, elev",
    ),
    ("nothing left", {"holdout": ("400003",)}, {"max_azimuth": 5}, "no camera is left for training", "400003"),
    ("segment", {"segment": "E999"}, {}, "no such segment", SEGMENT),
    ("frames beyond", {"frames": {"start": 7}}, {}, "the range of frames is empty", "000009"),
    ("frame unknown", {"frames": ("000004",)}, {}, "frames of `subjects`", "000009"),
]


@pytest.mark.parametrize(
    ("keys", "params", "message", "words"), [row[1:] for row in CHOICES], ids=[row[0] for row in CHOICES]
)
def test_choices_that_the_capture_does_not_have(
    tmp_path: Path, keys: Edit, params: Edit, message: str, words: str
) -> None:
    write_multiface(tmp_path / "c")
    error = refused(tmp_path / "c", "multiface", {"normalize": params}, **keys)
    assert (message in error.message, words in str(error)) == (True, True)


def test_two_segments_and_none_chosen(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c")
    (tmp_path / "c" / "images" / "E002_Swallow").mkdir()
    error = refused(tmp_path / "c", "multiface")
    assert error.expected == f"one of {SEGMENT}, E002_Swallow"


def test_an_unknown_front_camera(tmp_path: Path) -> None:
    write_transforms(tmp_path / "c")
    error = refused(tmp_path / "c", "transforms", front="36")
    assert (error.place, error.found) == ("front", "36")


def test_all_cameras_culled_says_their_angles(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c", turn=40)  # the mean head looks past all cameras
    error = refused(tmp_path / "c", "multiface", {"normalize": {"max_azimuth": 5}})
    assert error.message == "all cameras are culled"
    assert "400001 (0, -100)" in str(error.found)


def test_no_frame_is_complete(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    for camera, frame in zip(("400001", "400002", "400003"), made.frames, strict=True):
        made.image(camera, frame).unlink()
    error = refused(tmp_path / "c", "multiface")
    assert (error.message, "400002 lacks 1" in str(error.found)) == ("no frame has an image from every camera", True)


def test_stabilisation_without_head_poses(tmp_path: Path) -> None:
    write_transforms(tmp_path / "c")
    error = refused(tmp_path / "c", "transforms", {"normalize": {"stabilize": True}}, front="400003")
    assert "stabilize" in str(error.remedy)


def test_a_scene_that_is_there_survives_a_failed_run(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    folders = run(tmp_path / "c", "multiface")
    before = (folders.scene / "scene.json").read_text()
    cut(made.image("400005", "000009"), 3000)
    with pytest.raises(UserError, match="a damaged image"):
        run(tmp_path / "c", "multiface")
    assert (folders.scene / "scene.json").read_text() == before
    assert sorted(path.name for path in folders.root.iterdir()) == ["scene"]


def test_the_front_that_was_found_is_said_before_what_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, _ = write_transforms(tmp_path / "c")
    value = json.loads(path.read_text())
    value["frames"] += [{**value["frames"][0], "file_path": f"images/none{i}.png"} for i in range(9)]
    path.write_text(json.dumps(value))
    run(tmp_path / "c", "transforms")
    said = capsys.readouterr().out.splitlines()
    assert "taken to face where most cameras stand" in said[2]


def test_it_says_what_was_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = write_multiface(tmp_path / "c")
    made.image("400002", "000006").unlink()
    run(tmp_path / "c", "multiface")
    assert "frame 000006: no image from 400002" in capsys.readouterr().out
