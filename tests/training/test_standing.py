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
from facefolds_core.subject.splats import MEAN, OPACITY, Splats
from facefolds_core.subject.standing import farthest_moved, if_still, in_frame, standing, torso_of
from facefolds_core.subject.storage import Body
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.teacher import Teacher
from tests.geometry.test_track import about
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


SPLATS = some()
HEIGHT = SPLATS.means[:, 2]
LOWER, EVERY = HEIGHT < 0, np.ones(300, bool)


def told(splats: Splats, now: Splats) -> NDArray[np.bool_]:
    still = if_still(splats, POSES, 0, 1)
    return standing([(splats, still)], [targets_of(CAMERAS, drawn(now, CAMERAS))], splats.means)


def test_the_lower_half_stays_in_the_room() -> None:
    stands = told(SPLATS, in_frame(SPLATS, LOWER, POSES, 0, 1))
    assert (stands == LOWER)[np.abs(HEIGHT) > 0.15].mean() > 0.95
    assert told(SPLATS, SPLATS).mean() < 0.02
    assert told(SPLATS, if_still(SPLATS, POSES, 0, 1)).mean() > 0.98


def test_what_stays_is_where_it_was_in_the_room() -> None:
    there = if_still(SPLATS, POSES, 0, 1)
    np.testing.assert_allclose(moved(there, POSES.at(1)).means, SPLATS.means, atol=1e-5)
    assert in_frame(SPLATS, EVERY, POSES, 0, 0) is SPLATS


def test_what_no_picture_shows_tells_nothing() -> None:
    away = Similarity(1.0, np.eye(3), np.array([0.0, 5.0, 0.0]))
    noisy = targets_of(CAMERAS, drawn(SPLATS, CAMERAS) // 2)
    assert not standing([(SPLATS, moved(SPLATS, away))], [noisy], SPLATS.means).any()


def test_frames_that_turn_farthest_are_looked_at() -> None:
    turns = [about((0, 0, 1), degrees) for degrees in (0, 5, 20, -15, 19)]
    assert farthest_moved(Track.of(turns, np.zeros((5, 3))), 0) == [2, 3]
    assert farthest_moved(Track.of(turns[:1], np.zeros((1, 3))), 0) == []
    assert farthest_moved(Track.of(turns[:1] * 3, np.zeros((3, 3))), 1) == []
    assert farthest_moved(Track.of(turns[:1] * 3, [[0, 0, 0], [0.1, 0, 0], [0.3, 0, 0]]), 0) == [2, 1]


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """Two frames of a head that turns over what stands still, with mattes."""
    made = replace(make_scene(tmp_path / "scene", size=SIZE), poses=POSES)
    frames, mattes = [], []
    for i in range(len(made.cameras)):
        for k in range(2):
            rgba = drawn(in_frame(SPLATS, LOWER, POSES, 0, k), [made.camera_in_head(i, k)]).reshape(SIZE, SIZE, 4)
            frames.append((i, k, rgba[..., :3]))
            mattes.append((i, k, rgba[..., 3:]))
    write_frames(tmp_path / "scene" / "frames.arrow", (SIZE, SIZE, 3), frames)
    write_frames(tmp_path / "mattes.arrow", (SIZE, SIZE, 1), mattes)
    return replace(made, mattes=tmp_path / "mattes.arrow")


def test_a_tracked_mesh_moves_no_torso(scene: Scene) -> None:
    """In the head's own frame its vertices there move; layers have the torso where it was made."""
    mesh = np.stack([SPLATS.means, in_frame(SPLATS, LOWER, POSES, 0, 1).means]).astype(np.float32)
    mesh[1, ~LOWER, 0] += 0.01
    subject = replace(found(scene, 30.0), splats=SPLATS, torso=torso_of(SPLATS, LOWER, POSES.at(0)))
    now = Teacher(scene, subject, seed=0)._ridden(mesh, 1).means - SPLATS.means
    assert np.abs(now[HEIGHT < -0.1]).max() == 0
    head = now[HEIGHT > 0.1]
    np.testing.assert_allclose(head, np.tile([0.01, 0, 0], (len(head), 1)), atol=1e-3)


def test_the_plane_of_a_torso_parts_what_stands_from_what_does_not() -> None:
    pose, normal = POSES.at(1), np.array([0.1, 0.2, -1.0]) / np.linalg.norm([0.1, 0.2, -1.0])
    along = SPLATS.means @ normal
    torso = torso_of(SPLATS, along > 0.05, pose)
    assert torso is not None and np.dot(torso.normal, normal) > 0.97
    assert ((torso.share(SPLATS.means) > 0.5) == (along > 0.05)).mean() > 0.95
    np.testing.assert_allclose(torso.rest.rotation, pose.rotation, atol=1e-9)
    mixed = np.random.default_rng(0).random(300) < 0.5
    assert all(torso_of(SPLATS, labels, pose) is None for labels in (~EVERY, EVERY, mixed))


def test_mattes_of_other_frames_know_what_stands(scene: Scene) -> None:
    """Of the body, all of it the subject's; and of Gaussians whose mattes are given."""
    body = Mattes(scene, body=Body(SPLATS, EVERY, 0))
    assert body.anything_stands and (body.stands == LOWER)[np.abs(HEIGHT) > 0.15].mean() > 0.9
    given = Mattes(scene)
    given.alone = SPLATS
    assert given.anything_stands
    assert not Mattes(replace(scene, poses=None), body=Body(SPLATS, EVERY, 0)).anything_stands


def test_a_body_of_another_frame_begins_where_it_stands_in_the_reference_frame(scene: Scene) -> None:
    """Poses may be found after it."""
    later = in_frame(SPLATS, LOWER, POSES, 0, 1)
    begun = Mattes(scene, body=Body(later, EVERY, 1)).begun()
    off = [np.linalg.norm(one.means - SPLATS.means, axis=1)[LOWER].mean() for one in (begun, later)]
    assert off[0] < 0.35 * off[1]


def test_a_few_that_seem_to_stand_do_not() -> None:
    few = np.zeros(300, bool)
    few[np.argsort(HEIGHT)[:3]] = True
    assert not told(SPLATS, in_frame(SPLATS, few, POSES, 0, 1)).any()


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
    own = HEIGHT > -0.1
    stands = Mattes(scene, body=Body(SPLATS, own, 0)).stands
    assert stands[~own].all() and not stands[own].all()


def test_room_close_beside_a_head_goes_with_it(scene: Scene) -> None:
    """A room without texture may have Gaussians there, through which a head that turns would go."""
    beside = SPLATS.values.copy()
    beside[:, MEAN] += (0, 0, 0.02)
    both, own = replace(SPLATS, values=np.concatenate([SPLATS.values, beside])), np.repeat([True, False], 300)
    mattes = Mattes(scene, body=Body(both, own, 0))
    mattes.__dict__["stands"] = np.concatenate([LOWER, EVERY])
    there = in_frame(both, np.tile(LOWER, 2), POSES, 0, 1).means
    drawn_there = mattes._in_frame(both, mattes._stands_with, 0, 1).means
    near = np.abs(np.tile(HEIGHT, 2)) > 0.05
    np.testing.assert_allclose(drawn_there[near], there[near], atol=1e-6)
