"""Mattes from pictures: single cut-outs, and what pictures agree on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.cli.mattes import write_mattes
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CutOutParams, ExplicitParams, VoteParams
from facefolds_core.pictures import open_picture
from facefolds_core.training.mattes.cut_out import cut_out, opacity_in, reduced
from facefolds_core.training.mattes.find import CutOut, find_mattes, wanted_pictures
from facefolds_core.training.mattes.sheet import RED
from facefolds_core.training.mattes.vote import agreed, outvoted
from facefolds_core.training.volume import kernel
from facefolds_core.training.volume.cameras import CameraFit
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.room import Room
from tests.scenes import look_at_origin, make_scene

PARAMS = ExplicitParams()
VOXEL = 0.02


def _ball(radius: float) -> Volume:
    axis = -0.4 + VOXEL * np.arange(41)
    distance = np.linalg.norm(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1), axis=-1)
    grid = np.zeros((41, 41, 41, 4), np.float32)
    grid[..., 0] = np.where(distance < radius, kernel.LIMIT, -kernel.LIMIT)
    room = Room(np.zeros(3, np.float32), 1.0, 0.45, PARAMS.room, PARAMS.environment)
    return Volume(grid, np.full(3, -0.4), VOXEL, 0.7, room, 0, 30.0, CameraFit.alike(1, PARAMS.cameras))


def _cameras() -> list[Camera]:
    return [look_at_origin(f"c{a}", a, 10, 48, 1.2) for a in range(-60, 61, 20)]


def test_a_cut_out_has_the_pictures_outline_not_the_volumes() -> None:
    rng, (y, x) = np.random.default_rng(0), np.mgrid[:64, :64]
    disc = np.hypot(x - 32, y - 32) < 18
    image = np.where(disc[..., None], (200, 150, 120), (40, 60, 90)) + rng.integers(-8, 9, (64, 64, 3))
    rough = np.clip(1.2 - np.hypot(x - 34, y - 32) / 20, 0, 1).astype(np.float32)  # blurred, off, too small
    found = cut_out(image.astype(np.uint8), rough, CutOutParams()) > 0
    assert (found & disc).sum() / (found | disc).sum() > 0.98
    coarse = rough > 0.5
    assert (coarse & disc).sum() / (coarse | disc).sum() < 0.7


def test_a_picture_that_is_all_subject_or_all_room_is_left_alone() -> None:
    image = np.zeros((16, 16, 3), np.uint8)
    assert cut_out(image, np.ones((16, 16), np.float32), CutOutParams()).all()
    assert not cut_out(image, np.zeros((16, 16), np.float32), CutOutParams()).any()


def test_one_picture_cannot_add_to_what_the_others_see() -> None:
    ball, cameras = _ball(0.15), _cameras()
    right = [(opacity_in(ball, camera) > 0.5).astype(np.uint8) for camera in cameras]
    wrong = [one.copy() for one in right]
    wrong[2][:8] = 1  # a lamp above the head
    hull = agreed(ball, cameras, wrong, VoteParams())
    mended, agreement = outvoted(hull, cameras, wrong, VoteParams())
    assert not mended[2][:8].any()
    assert agreement.argmin() == 2


def test_one_picture_cannot_take_from_what_the_others_see() -> None:
    ball, cameras = _ball(0.15), _cameras()
    pictures = [(opacity_in(ball, camera) > 0.5).astype(np.uint8) for camera in cameras]
    whole = agreed(ball, cameras, pictures, VoteParams()).grid[..., 0] > 0
    pictures[3][:24] = 0
    left = agreed(ball, cameras, pictures, VoteParams()).grid[..., 0] > 0
    assert left.sum() > 0.95 * whole.sum()  # at the outline others doubt, too


def test_pictures_are_reduced_never_enlarged() -> None:
    camera = look_at_origin("a", 0, 0, 48, 1.2)
    assert (reduced(camera, 24).height, reduced(camera, 24).width) == (24, 24)
    assert (reduced(camera, 96).height, reduced(camera, 96).width) == (48, 48)


def test_what_is_outvoted_is_on_the_sheet_but_not_among_the_mattes(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", size=16)
    grey, matte = np.full((8, 8, 3), 99, np.uint8), np.ones((8, 8), np.uint8)
    found = [CutOut(0, 0, grey, matte, 0.9, True), CutOut(1, 0, grey, matte, 0.3, False)]
    write_mattes(tmp_path / "mattes", scene, found)
    names = [scene.cameras[c].name for c in (0, 1)]
    written = sorted(path.relative_to(tmp_path / "mattes").as_posix() for path in (tmp_path / "mattes").rglob("*.png"))
    assert written == sorted(["mattes.png", f"{names[0]}/{scene.frame_ids[0]}.png"])
    assert np.asarray(open_picture(tmp_path / "mattes" / written[0])).shape == (16, 16)
    sheet = np.asarray(open_picture(tmp_path / "mattes" / "mattes.png")).astype(int)
    assert (np.abs(sheet - np.array(RED)).sum(-1) < 30).any()


def test_training_cameras_vote_about_all_pictures(tmp_path: Path) -> None:
    scene, ball = make_scene(tmp_path, size=64), _ball(0.33)
    volume = replace(ball, lower=ball.lower + np.array(SPHERE_CENTRE))
    pictures = wanted_pictures(scene, volume)
    held = scene.indices("holdout")
    assert {camera for camera, _ in pictures} == set(range(len(scene.cameras)))
    assert sorted(frame for camera, frame in pictures if camera == held[0]) == list(range(scene.num_frames))
    with tqdm(disable=True) as bar:
        found = find_mattes(scene, volume, pictures, PARAMS, bar)
    assert [(one.camera, one.frame) for one in found] == pictures
    assert any(one.believed and one.matte.any() and not one.matte.all() for one in found)


def test_what_stands_in_the_heads_shadow_is_no_subject() -> None:
    """Behind the head one picture's bookshelf is undisputed: the others see the head there."""
    ball, cameras = _ball(0.15), _cameras()
    pictures = [(opacity_in(ball, camera) > 0.5).astype(np.uint8) for camera in cameras]
    pictures[0][:, :12] = 1
    mended, agreement = outvoted(agreed(ball, cameras, pictures, VoteParams()), cameras, pictures, VoteParams())
    assert not mended[0][:, :6].any()
    assert agreement.argmin() == 0
