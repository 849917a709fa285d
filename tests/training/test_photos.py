"""What a capture knows beside its pictures: clean plates and mattes in the starting volume."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from facefolds_core.frame_store import write_frames
from facefolds_core.geometry.track import Track, rotation
from facefolds_core.training.explicit.views import Images
from facefolds_core.training.photos import Photo, PosedPhoto, photos_of, posed_photos
from facefolds_core.training.volume.optimise import rays_of
from tests.scenes import look_at_origin, make_scene


def test_plates_and_mattes_are_found_where_they_are(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=16)
    first, second = scene.indices("train")[:2]
    shape = (scene.height, scene.width)
    write_frames(scene.folder / "plates.arrow", (*shape, 3), [(first, 0, np.full((*shape, 3), 7, np.uint8))])
    write_frames(scene.folder / "mattes.arrow", (*shape, 1), [(second, 0, np.full((*shape, 1), 9, np.uint8))])
    one, two = photos_of(scene, [first, second], 0)
    assert one.plate is not None and (one.plate == 7).all() and one.matte is None
    assert two.matte is not None and (two.matte == 9).all() and two.plate is None
    plates = Images(scene).plates()
    assert plates[0] is not None and (plates[0] == 7).all() and plates[1] is None


def test_rays_know_what_is_behind_them_and_what_is_not() -> None:
    camera = look_at_origin("c", 0, 0, 8)
    grey = np.full((8, 8, 3), 102, np.uint8)
    matte = np.full((8, 8, 1), 51, np.uint8)
    rays = rays_of(
        [
            PosedPhoto(Photo(grey, plate=grey), camera, camera, 0),
            PosedPhoto(Photo(grey, matte=matte), camera, camera, 1),
        ],
        0.01,
        0.7,
    )
    half = len(rays.camera) // 2
    behind, unknown = rays.over(np.zeros_like(rays.colours))
    assert not unknown[:half].any() and unknown[half:].all()
    np.testing.assert_allclose(behind[:half], 0.4, atol=1e-6)
    assert (behind[half:] == 0).all()
    assert (rays.matte[:half] == -1).all()
    np.testing.assert_allclose(rays.matte[half:], 0.2, atol=1e-6)
    part = rays.choose(np.array([0, half]))
    assert part.camera.tolist() == [0, 1] and np.isnan(part.plate[1]).all()


def test_beside_the_subject_a_matte_makes_the_picture_the_plate() -> None:
    """What is behind there is what is seen: nothing has to explain it, least of all the subject."""
    camera = look_at_origin("c", 0, 0, 8)
    matte = np.zeros((8, 8, 1), np.uint8)
    matte[:, 4:] = 255
    rays = rays_of([PosedPhoto(Photo(np.full((8, 8, 3), 102, np.uint8), matte=matte), camera, camera, 0)], 0.01, 0.7)
    behind, unknown = rays.over(np.zeros_like(rays.colours))
    np.testing.assert_array_equal(unknown, rays.matte > 0)
    np.testing.assert_allclose(behind[~unknown], 0.4, atol=1e-6)


def test_the_room_stays_where_the_head_turns(tmp_path: Path) -> None:
    """In every frame the room's rays are those of the first one; the head's turn with it."""
    still = make_scene(tmp_path, size=16, frames=3)
    turn = [rotation(np.array([np.cos(a / 2), 0, 0, np.sin(a / 2)])) for a in (0.0, 0.2, 0.4)]
    scene = replace(still, poses=Track.of(turn, np.zeros((3, 3))))
    first, second = scene.indices("train")[:2]
    views = posed_photos(scene, [first, second], [1, 2])
    assert [view.number for view in views] == [0, 1, 0, 1]
    np.testing.assert_allclose(views[0].camera.w2c, views[0].in_room.w2c)
    np.testing.assert_allclose(views[2].in_room.w2c, views[0].in_room.w2c)
    turned = np.arctan2(*views[2].camera.centre[1::-1]) - np.arctan2(*views[0].camera.centre[1::-1])
    assert abs(turned + 0.2) < 1e-6
