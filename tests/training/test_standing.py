"""What stands still while the head turns: told from the head by pictures, for mattes and for a training."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track
from facefolds_core.params import ExplicitParams
from facefolds_core.subject.foreign import moved
from facefolds_core.subject.frames import targets_of
from facefolds_core.subject.mattes import Mattes
from facefolds_core.subject.splats import OPACITY, Splats
from facefolds_core.subject.standing import farthest_moved, if_still, in_frame, standing, torso_of
from facefolds_core.subject.storage import Body
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.teacher import Teacher
from tests.scenes import look_at_origin, make_scene
from tests.subject.splats import drawn, found
from tests.subject.splats import some as any_splats

SIZE = 48
CAMERAS = [look_at_origin(f"c{a}", a, 5, SIZE) for a in (-40, -15, 15, 40)]
SIDEWAYS = np.array([[0.98, -0.199, 0], [0.199, 0.98, 0], [0, 0, 1]])
POSES = Track.of([np.eye(3), SIDEWAYS], [[0.0, 0, 0], [0.02, 0.05, 0]])


def some() -> Splats:
    """More of them opaque."""
    splats = any_splats()
    splats.values[:, OPACITY] += 2
    return splats


def told(splats: Splats, now: Splats) -> NDArray[np.bool_]:
    still = if_still(splats, POSES, 0, 1)
    return standing([(splats, still)], [targets_of(CAMERAS, drawn(now, CAMERAS))], splats.means)


def test_the_lower_half_stays_in_the_room() -> None:
    splats = some()
    lower = splats.means[:, 2] < 0
    stands = told(splats, in_frame(splats, lower, POSES, 0, 1))
    assert (stands == lower)[np.abs(splats.means[:, 2]) > 0.15].mean() > 0.95
    assert told(splats, splats).mean() < 0.02
    assert told(splats, if_still(splats, POSES, 0, 1)).mean() > 0.98


def test_what_stays_is_where_it_was_in_the_room() -> None:
    splats, world = some(), POSES.at(1)
    there = if_still(splats, POSES, 0, 1)
    np.testing.assert_allclose(moved(there, world).means, splats.means, atol=1e-5)
    assert in_frame(splats, np.ones(300, bool), POSES, 0, 0) is splats


def test_what_no_picture_shows_tells_nothing() -> None:
    splats, away = some(), Similarity(1.0, np.eye(3), np.array([0.0, 5.0, 0.0]))
    noisy = targets_of(CAMERAS, drawn(splats, CAMERAS) // 2)
    assert not standing([(splats, moved(splats, away))], [noisy], splats.means).any()


def test_frames_that_turn_farthest_are_looked_at() -> None:
    turns = [Track.of([np.eye(3)], [np.zeros(3)]).at(0).rotation]
    for degrees in (5, 20, -15, 19):
        a = np.radians(degrees)
        turns.append(np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]))
    assert farthest_moved(Track.of(turns, np.zeros((5, 3))), 0) == [2, 3]
    assert farthest_moved(Track.of(turns[:1], np.zeros((1, 3))), 0) == []
    assert farthest_moved(Track.of(turns[:1] * 3, np.zeros((3, 3))), 1) == []
    assert farthest_moved(Track.of(turns[:1] * 3, [[0, 0, 0], [0.1, 0, 0], [0.3, 0, 0]]), 0) == [2, 1]


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """Two frames of a head that turns over what stands still, with mattes."""
    made = replace(make_scene(tmp_path / "scene", size=SIZE), poses=POSES)
    splats, lower = some(), some().means[:, 2] < 0
    frames, mattes = [], []
    for i in range(len(made.cameras)):
        for k in range(2):
            (rgba,) = drawn(in_frame(splats, lower, POSES, 0, k), [made.camera_in_head(i, k)])
            frames.append((i, k, rgba.reshape(SIZE, SIZE, 4)[..., :3]))
            mattes.append((i, k, rgba.reshape(SIZE, SIZE, 4)[..., 3:]))
    write_frames(tmp_path / "scene" / "frames.arrow", (SIZE, SIZE, 3), frames)
    write_frames(tmp_path / "mattes.arrow", (SIZE, SIZE, 1), mattes)
    return replace(made, mattes=tmp_path / "mattes.arrow")


def photos(scene: Scene, frame: int) -> NDArray[np.uint8]:
    store, mattes = scene.open_frames(), scene.open_mattes()
    assert mattes is not None
    keys = [(i, frame) for i in scene.indices("train")]
    return np.stack([np.concatenate([store.image(*k), mattes.image(*k)], -1).reshape(-1, 4) for k in keys])


def test_a_tracked_mesh_moves_no_torso(scene: Scene) -> None:
    """In the head's own frame its vertices there move; layers have the torso where it was made."""
    subject, splats = found(scene, 30.0), some()
    lower = splats.means[:, 2] < 0
    mesh = np.stack([splats.means, in_frame(splats, lower, POSES, 0, 1).means]).astype(np.float32)
    mesh[1, ~lower, 0] += 0.01
    teacher = Teacher(scene, replace(subject, splats=splats, torso=torso_of(splats, lower, POSES.at(0))), seed=0)
    now = teacher._ridden(mesh, 1).means - splats.means
    clear = np.abs(splats.means[:, 2]) > 0.1
    assert np.abs(now[lower & clear]).max() == 0
    np.testing.assert_allclose(now[~lower & clear], np.tile([0.01, 0, 0], (int((~lower & clear).sum()), 1)), atol=1e-3)


def test_the_plane_of_a_torso_parts_what_stands_from_what_does_not() -> None:
    splats, pose = some(), POSES.at(1)
    normal = np.array([0.1, 0.2, -1.0]) / np.linalg.norm([0.1, 0.2, -1.0])
    along = splats.means @ normal
    torso = torso_of(splats, along > 0.05, pose)
    assert torso is not None and np.dot(torso.normal, normal) > 0.97
    assert ((torso.share(splats.means) > 0.5) == (along > 0.05)).mean() > 0.95
    np.testing.assert_allclose(torso.rest.rotation, pose.rotation, atol=1e-9)
    nothing, every = np.zeros(300, bool), np.ones(300, bool)
    mixed = np.random.default_rng(0).random(300) < 0.5
    assert all(torso_of(splats, labels, pose) is None for labels in (nothing, every, mixed))


def test_mattes_of_other_frames_know_what_stands(scene: Scene) -> None:
    """Of the body, all of it the subject's; and of Gaussians whose mattes are given."""
    splats, lower = some(), some().means[:, 2] < 0
    sure = np.abs(splats.means[:, 2]) > 0.15
    body = Mattes(scene, body=Body(splats, np.ones(300, bool), 0))
    assert body.anything_stands and (body.stands == lower)[sure].mean() > 0.9
    given = Mattes(scene)
    given.alone = splats
    assert given.anything_stands
    still = Mattes(replace(scene, poses=None), body=Body(splats, np.ones(300, bool), 0))
    assert not still.anything_stands


def test_a_body_of_another_frame_begins_where_it_stands_in_the_reference_frame(scene: Scene) -> None:
    """Poses may be found after it."""
    splats = some()
    lower = splats.means[:, 2] < 0
    later = in_frame(splats, lower, POSES, 0, 1)
    begun = Mattes(scene, body=Body(later, np.ones(300, bool), 1)).begun()
    off = [np.linalg.norm(one.means - splats.means, axis=1)[lower].mean() for one in (begun, later)]
    assert off[0] < 0.35 * off[1]


def test_a_few_that_seem_to_stand_do_not() -> None:
    splats = some()
    few = np.argsort(splats.means[:, 2]) < 0
    few[np.argsort(splats.means[:, 2])[:3]] = True
    assert not told(splats, in_frame(splats, few, POSES, 0, 1)).any()


def test_a_frame_begins_with_colours_of_its_own_and_keeps_them_where_layers_move() -> None:
    state = TextureState((4, 6), 3, 2, torch.full((2, 2, 3), 0.5), ExplicitParams())
    opacity = np.random.default_rng(0).uniform(0.1, 0.9, (24, 3)).astype(np.float32)
    rgb, own = (np.full((24, 3, 3), value, np.float32) for value in (0.4, 0.7))
    state.fill(opacity, rgb)
    state.fill_frame(1, opacity, own)
    state.fill(opacity)
    for frame, value in enumerate((0.4, 0.7)):
        np.testing.assert_allclose(state.activated(frame)[..., :3].numpy(), value, atol=1e-5)


def test_gaussians_of_the_room_stand(scene: Scene) -> None:
    splats, own = some(), some().means[:, 2] > -0.1
    stands = Mattes(scene, body=Body(splats, own, 0)).stands
    assert stands[~own].all() and not stands[own].all()
