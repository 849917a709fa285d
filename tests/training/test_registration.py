"""Poses found from pictures: a textured sphere that turns, frames that fit nowhere, what is written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track, turn_of
from facefolds_core.params import NormalizeParams
from facefolds_core.training import registration
from facefolds_core.training.alignment import Points, features, look_up, refined
from facefolds_core.training.registration import Found, with_found_poses
from tests.geometry.test_track import about
from tests.memory import peak_of
from tests.scenes import CENTRE, OPAQUE, first_hit, look_at_origin, make_scene, render

SIZE = 96
TRACK = Track.of([np.eye(3), about((0, 0.3, 1), 5)], [[0, 0, 0], [0.01, -0.02, 0.01]])


def points_of(camera_index: int, cameras: list[Camera]) -> Points:
    """What a camera sees of the sphere that stands still."""
    camera = cameras[camera_index]
    pixels = camera.pixel_centres()[::2, ::2].reshape(-1, 2)
    origins, directions = camera.rays(pixels)
    distance, hit = first_hit(origins, directions, OPAQUE[0].radius)
    there = (origins + distance[..., None] * directions)[hit]
    normals = (there - CENTRE) / OPAQUE[0].radius
    return Points(there, normals, pixels[hit], np.ones(int(hit.sum())))


def turn_found(still: int = 0, weight: float = 1.0) -> tuple[float, float, float]:
    """Degrees and units that a pose of TRACK is off, and likeness; so many of four cameras show what does not move, and
    count so much."""
    cameras = [look_at_origin(str(i), azimuth, 10 * (-1) ** i, SIZE) for i, azimuth in enumerate((-40, -10, 20, 45))]
    points = [points_of(i, cameras) for i in range(4)]
    points[:still] = [replace(one, weight=weight * one.weight) for one in points[:still]]
    pose, likeness = Similarity.identity(), 0.0
    for sigma in (4.0, 1.5):
        first = [features(np.round(255 * render(c, OPAQUE, 0)[0]).astype(np.uint8), sigma) for c in cameras]
        moved = [c if i < still else TRACK.camera(c, 1) for i, c in enumerate(cameras)]
        shown = [features(np.round(255 * render(c, OPAQUE, 0)[0]).astype(np.uint8), sigma) for c in moved]
        seen = [look_up(a, p.pixels)[:, 0] for a, p in zip(first, points, strict=True)]
        pose, likeness = refined(pose, cameras, points, shown, seen)
    off = TRACK.at(1).inverse().after(pose)
    degrees = float(Track.of([off.rotation], [off.translation]).degrees()[0])
    return degrees, float(np.linalg.norm(off.apply(np.zeros(3)))), likeness


def test_a_turn_and_a_shift_are_found() -> None:
    degrees, shift, likeness = turn_found()
    assert likeness > 0.95
    assert degrees < 0.5  # of 5; seen 0.34
    assert shift < 0.003  # of 0.024; seen 0.001


def test_shoulders_that_stand_still_do_not_hold_the_head() -> None:
    """Points far from the cameras' centre count little."""
    assert turn_found(still=2)[0] > 2
    for still in (2, 3):
        degrees, _, likeness = turn_found(still, weight=0.01)
        assert degrees < 1  # of 5; seen 0.84, 0.67
        assert likeness > 0.9


def test_points_count_by_their_distance_from_the_cameras_centre() -> None:
    random = np.random.default_rng(0)
    clouds = [random.normal(0, width, (500, 3)) for width in (1.0, 3.0)]
    found = registration.weighted([Points(one, one, one[:, :2], np.ones(500)) for one in clouds])
    assert (np.concatenate([one.weight for one in found]) > np.exp(-0.5)).mean() == pytest.approx(0.25)
    for one, cloud in zip(found, clouds, strict=True):
        assert (np.argsort(-one.weight) == np.argsort(np.linalg.norm(cloud, axis=1))).all()


def test_a_frame_that_leaps_is_refused_and_bridged() -> None:
    poses = [Similarity(1.0, turn_of(np.array([0, 0, 0.02 * k])), np.array([0.01 * k, 0, 0])) for k in range(5)]
    leaping = [*poses[:2], Similarity(1.0, turn_of(np.array([0.6, 0, 0])), np.zeros(3)), *poses[3:]]
    assert registration._refused(poses, np.ones(5), 0) == []
    refused = registration._refused(leaping, np.ones(5), 0)
    assert 2 in refused
    bridged = registration._bridged(leaping, [2])
    assert np.abs(bridged[2].rotation - poses[2].rotation).max() < 1e-6
    assert bridged[2].translation == pytest.approx(poses[2].translation)


def test_a_frame_that_looks_like_nothing_is_refused() -> None:
    assert registration._refused([Similarity.identity()] * 4, np.array([1, 0.8, 0.2, 0.9]), 0) == [2]


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return make_scene(tmp_path / "scene", size=16)


@pytest.mark.parametrize(
    ("stabilize", "degrees", "posed"),
    [("found", 0.5, True), ("auto", 5.0, True), ("auto", 0.5, False), (False, 5.0, False), (True, 5.0, False)],
)
def test_when_poses_are_looked_for_and_kept(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, stabilize: object, degrees: float, posed: bool
) -> None:
    found = Found(TRACK, degrees, 0.0, np.ones(2), ())
    monkeypatch.setattr(registration, "find_track", lambda *_: found)
    with_found_poses(scene, NormalizeParams(stabilize=stabilize))  # type: ignore[arg-type]
    back = read_scene(scene.folder)
    assert (back.poses is not None) == posed
    assert [one.kind for one in back.left_out] == (["head_turns"] if posed else [])


def test_pictures_that_tell_nothing_stop_only_who_asked(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: object) -> Found:
        raise UserError("no subject was found in the images")

    monkeypatch.setattr(registration, "find_track", nothing)
    assert with_found_poses(scene, NormalizeParams(stabilize="auto")) is scene
    with pytest.raises(UserError, match="no subject"):
        with_found_poses(scene, NormalizeParams(stabilize="found"))
    posed = replace(scene, poses=TRACK)  # it keeps those that it has
    assert with_found_poses(posed, NormalizeParams(stabilize="auto")) is posed


def test_a_tracked_mesh_follows_the_poses_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_scene(tmp_path / "scene", size=16, surface_radius=0.33)
    before = scene.load_surface()
    monkeypatch.setattr(registration, "find_track", lambda *_: Found(TRACK, 5.0, 0.0, np.ones(2), ()))
    with_found_poses(scene, NormalizeParams(stabilize="found"))
    after = read_scene(scene.folder).load_surface()
    assert before is not None and after is not None
    assert np.abs(TRACK.at(1).apply(after[0][1].astype(float)) - before[0][1]).max() < 1e-6
    assert np.array_equal(after[0][0], before[0][0])


def test_a_long_takes_meshes_are_moved_a_few_frames_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = 250
    scene = replace(make_scene(tmp_path / "scene", size=16), frame_ids=tuple(f"{k:03d}" for k in range(frames)))
    scene = replace(scene, times=np.arange(frames) / 30)
    vertices = np.random.default_rng(0).normal(size=(frames, 8000, 3)).astype(np.float32)
    np.savez(scene.folder / "surface.npz", vertices=vertices, faces=np.array([[0, 1, 2]], np.int32))
    track = Track(np.tile([1.0, 0, 0, 0], (frames, 1)), np.tile([0.5, 0, 0], (frames, 1)))
    monkeypatch.setattr(registration, "find_track", lambda *_: Found(track, 5.0, 0.0, np.ones(frames), ()))
    peak = peak_of(lambda: with_found_poses(scene, NormalizeParams(stabilize="found")))
    assert peak < 22e6  # at once 120e6; 17e6 are what NumPy writes at a time
    after = read_scene(scene.folder).load_surface()
    assert after is not None
    assert np.abs(after[0] - (vertices - [0.5, 0, 0])).max() < 1e-6
