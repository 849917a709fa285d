"""The normalised scene: coordinates, culling, split, what it holds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.assembly import write_plan
from facefolds_core.captures.capture import complete_subset
from facefolds_core.captures.normalization import nearest_to_axes, split_cameras, view_angles
from facefolds_core.captures.picture import FilePicture
from facefolds_core.captures.scene import read_scene
from facefolds_core.errors import UserError
from facefolds_core.facts import fact
from facefolds_core.params import HoldoutEvery, NormalizeParams, Subject
from facefolds_core.pipeline.normalize import left_out
from tests.captures.fixtures import (
    FACES,
    HEAD,
    RING,
    SEGMENT,
    VERTICES,
    edit_transforms,
    head_pose,
    opengl_matrix,
    plan_of,
    save,
    world_camera,
    write_multiface,
    write_transforms,
)
from tests.filmed import Reader

POINTS = HEAD + np.random.default_rng(0).uniform(-100, 100, (40, 3))


def test_projection_agrees_before_and_after_normalisation_and_downsampling(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    scene = plan_of(tmp_path / "c", NormalizeParams(long_side=32, short_side=32)).scene
    assert (scene.width, scene.height) == (20, 32)
    for before, after in zip(made.cameras, scene.cameras, strict=True):
        pixels, _ = after.project(scene.from_capture.apply(POINTS))
        assert np.abs(2 * pixels - before.project(POINTS)[0]).max() < 1e-3


def test_projection_agrees_for_a_distorted_transforms_capture(tmp_path: Path) -> None:
    write_transforms(tmp_path / "c", k1=0.2, k2=-0.03, p1=0.002, p2=0.001)
    plan = plan_of(tmp_path / "c", NormalizeParams(long_side=32, short_side=32), source="transforms")
    for camera, view in zip(plan.scene.cameras, plan.capture.views, strict=True):
        in_camera = POINTS @ view.camera.rotation.T + view.camera.w2c[:, 3]
        photo = view.lens.distort(in_camera[:, :2] / in_camera[:, 2:])
        straight = 2 * camera.project(plan.scene.from_capture.apply(POINTS))[0]
        assert np.abs(view.lens.source_of(straight) - photo).max() < 1e-3


def test_a_tracked_head_is_at_the_origin_and_faces_x(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c")
    move = plan_of(tmp_path / "c").scene.from_capture
    rotation, translation = head_pose(1)  # the middle one of three
    head = np.stack([translation, translation + 100 * rotation[:, 2], translation + 100 * rotation[:, 1]])
    origin, face, top = move.apply(head)
    assert origin == pytest.approx([0, 0, 0], abs=1e-9)
    assert face / np.linalg.norm(face) == pytest.approx([1, 0, 0], abs=1e-9)
    assert top / np.linalg.norm(top) == pytest.approx([0, 0, 1], abs=1e-9)


# Without `front` the mean of the five directions and that of their image tops, a little askew, take its place.
@pytest.mark.parametrize(("front", "degrees"), [("400003", 1e-6), (None, 1.5)])
def test_without_a_tracked_head_the_cameras_say_where_it_is(tmp_path: Path, front: str | None, degrees: float) -> None:
    write_transforms(tmp_path / "c")
    plan = plan_of(tmp_path / "c", front=front, source="transforms")
    assert plan.scene.from_capture.apply(HEAD) == pytest.approx([0, 0, 0], abs=1e-6)
    angles = view_angles(plan.scene.cameras)
    assert angles[:, 1] == pytest.approx([azimuth for _, azimuth, _ in RING], abs=degrees)
    assert angles[:, 0] == pytest.approx([elevation for _, _, elevation in RING], abs=degrees)


def test_the_point_nearest_to_the_axes_ignores_a_camera_that_looks_elsewhere() -> None:
    good = [world_camera(str(a), a, 10 * (a % 3)) for a in range(-80, 81, 20)]
    away = world_camera("away", 33, 0)
    away = replace(away, w2c=np.concatenate([away.rotation, away.w2c[:, 3:] + [[150.0], [0], [0]]], 1))
    assert np.linalg.norm(nearest_to_axes(good) - HEAD) < 1e-6
    assert np.linalg.norm(nearest_to_axes([*good, away]) - HEAD) < 1.0  # millimetres; plain least squares: 14


def test_cameras_beyond_the_angles_are_culled_and_named(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c")
    params = NormalizeParams(max_elevation=9, max_azimuth=90)
    scene = plan_of(tmp_path / "c", params).scene
    assert [camera.name for camera in scene.cameras] == ["400001", "400003", "400005"]
    assert [(one.kind, one.camera) for one in scene.left_out[1:]] == [("culled", "400002"), ("culled", "400004")]


@pytest.mark.parametrize(("every", "held"), [(2, "bd"), (3, "c"), (5, "e")])
def test_every_nth_camera_is_held_out(every: int, held: str) -> None:
    subject = Subject(source="transforms", path=".", holdout=HoldoutEvery(every=every))
    splits = split_cameras("abcde", subject, [], "capture")
    assert splits == tuple("holdout" if name in held else "train" for name in "abcde")


def test_too_few_cameras_for_a_hold_out_are_refused_before_anything_is_trained() -> None:
    subject = Subject(source="transforms", path=".")
    with pytest.raises(UserError, match="too few cameras to hold one out") as caught:
        split_cameras("abcde", subject, [], "capture")
    assert "['c']" in str(caught.value)
    assert split_cameras("abcde", subject.model_copy(update={"holdout": ()}), [], "capture") == ("train",) * 5


@pytest.mark.parametrize(
    ("validate", "splits"),
    [
        (None, ["train", "train", "holdout", "train", "train", "holdout"]),
        ({"every": 2}, ["train", "validate", "holdout", "train", "validate", "holdout"]),  # of those not held out
        (["a"], ["validate", "train", "holdout", "train", "train", "holdout"]),
    ],
)
def test_cameras_for_validation_are_taken_from_those_that_would_train(validate: object, splits: list[str]) -> None:
    subject = Subject.model_validate({"source": "actor", "path": ".", "holdout": {"every": 3}, "validate": validate})
    assert list(split_cameras("abcdef", subject, [], "capture")) == splits


@pytest.mark.parametrize(
    ("validate", "says"),
    [
        (["c"], "held out and for validation"),
        (["x"], "a camera for validation is not there"),
        (["a", "b", "d", "e"], "no camera is left for training"),
    ],
)
def test_a_wrong_choice_for_validation_is_named(validate: list[str], says: str) -> None:
    subject = Subject.model_validate({"source": "actor", "path": ".", "holdout": {"every": 3}, "validate": validate})
    with pytest.raises(UserError, match=says) as error:
        split_cameras("abcdef", subject, [], "capture")
    assert error.value.place == "validate"


def test_the_scene_holds_photos_surface_and_masks_of_cameras_that_do_not_train(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c", turn=10)
    for camera in ("400001", "400003", "400004"):
        save(tmp_path / "c" / "masks" / SEGMENT / camera / "000006.png", np.full((64, 40), 200, np.uint8))
    write_plan(plan_of(tmp_path / "c", validate=("400001",)), NormalizeParams())
    scene = read_scene(tmp_path / "scene")
    store, masks, (vertices, faces) = scene.open_frames(), scene.open_masks(), scene.load_surface()
    assert store.keys() == [(c, f) for c in range(5) for f in range(3)]
    assert np.array_equal(store.image(3, 1), FilePicture(made.image("400004", "000006")).rgb(""))
    assert masks.keys() == [(0, 1), (2, 1)]
    assert int(masks.image(2, 1)[5, 5, 0]) == 200
    rotation, translation = head_pose(2, 10)
    before = made.cameras[1].project(VERTICES @ rotation.T + translation)[0]
    # The file holds float32: 1e-5 px seen.
    assert np.abs(scene.camera_in_head(1, 2).project(vertices[2].astype(float))[0] - before).max() < 1e-3
    assert np.array_equal(faces, FACES)


def test_a_frame_that_one_camera_lacks_is_left_out_of_everything(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    made.image("400002", "000006").unlink()
    plan = plan_of(tmp_path / "c")
    assert plan.scene.frame_ids == ("000003", "000009") and len(plan.vertices) == 2
    assert "frame 000006: no image from 400002" in map(str, plan.scene.left_out)


def test_a_frame_that_only_a_culled_camera_lacks_stays(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    made.image("400001", "000006").unlink()
    assert plan_of(tmp_path / "c", NormalizeParams(max_azimuth=45)).scene.num_frames == 3


def test_a_camera_that_lacks_most_frames_is_left_out_instead(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    for frame in ("000006", "000009"):
        made.image("400002", frame).unlink()
    cameras, frames, lines = complete_subset(Reader("multiface")(tmp_path / "c"), range(5))
    assert (cameras, frames, len(lines)) == ([0, 2, 3, 4], [0, 1, 2], 1)


def test_entries_turned_by_90_degrees_do_not_matter_when_there_is_a_front_camera(tmp_path: Path) -> None:
    path, cameras = write_transforms(tmp_path / "c")
    turned = replace(cameras[1], w2c=np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]) @ cameras[1].w2c)
    edit_transforms(path, 1, transform_matrix=opengl_matrix(turned))
    scene = plan_of(tmp_path / "c", source="transforms").scene
    assert view_angles(scene.cameras)[1] == pytest.approx([10, -20], abs=1e-6)


@pytest.mark.captures
def test_the_shared_captures_keep_the_cameras_that_see_the_front(captures_folder: Path) -> None:
    face = plan_of(captures_folder / "mugsy", holdout=("400013", "400060"), pixel_centres=0.5).scene
    statue = plan_of(captures_folder / "buddha", holdout=("00022", "00031"), front="00036", source="transforms").scene
    assert [(len(s.indices("train")), len(s.indices("holdout"))) for s in (face, statue)] == [(30, 2), (19, 2)]


def test_notes_are_said_before_lists_of_what_is_missing(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c")
    scene = plan_of(tmp_path / "c").scene
    missing = [fact("culled", camera=str(i), elevation=60.0, azimuth=0.0) for i in range(9)]
    lines = left_out(replace(scene, left_out=(*missing, fact("front_found", camera="1", share=0.9))))
    assert lines[1].startswith("  note: no `front`")
