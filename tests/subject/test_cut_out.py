"""Mattes of single pictures: cut out, and beside plates."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.subject import cut_out as cut_out_module
from facefolds_core.subject.cut_out import INSIDE, agreement, around, colours_of, cut_out, doubted, softened
from facefolds_core.subject.plates import Expectation, from_plate
from tests.scenes import look_at_origin


def cut(image: np.ndarray, rough: np.ndarray) -> np.ndarray:
    """A silhouette, bool, by the colours of this picture."""
    camera = look_at_origin("c", 0, 0, len(image))
    return cut_out(image, rough, camera, colours_of([(image, rough, camera)]))


def skin(shown: np.ndarray, seed: int) -> np.ndarray:
    """A picture of what is shown before a bluish wall."""
    noise = np.random.default_rng(seed).integers(-8, 9, (*shown.shape, 3))
    return (np.where(shown[..., None], (200, 150, 120), (40, 60, 90)) + noise).astype(np.uint8)


def test_a_cut_out_has_the_pictures_outline_not_the_volumes() -> None:
    y, x = np.mgrid[:64, :64]
    disc = np.hypot(x - 32, y - 32) < 18
    rough = np.clip(1.2 - np.hypot(x - 34, y - 32) / 24, 0, 1).astype(np.float32)  # blurred, off, of another size
    assert agreement(cut(skin(disc, 0), rough), disc) > 0.98
    assert agreement(rough > 0.5, disc) < 0.85


@pytest.mark.parametrize("size", [96, 384])
def test_of_a_lamp_of_the_subjects_colour_only_what_is_near_the_volume_is_cut_out(size: int) -> None:
    rng, (y, x) = np.random.default_rng(1), np.mgrid[:size, :size] / size * 96
    away = np.hypot(x - 48, y - 48)
    shown = (away < 30) | ((abs(y - 48) < 4) & (x > 48))
    image = np.where(shown[..., None], (110, 75, 55), (60, 90, 140)) + rng.integers(-8, 9, (size, size, 1))
    volume = np.clip(0.5 + (30 - away) / 4, 0, 1).astype(np.float32)
    found = cut(image.astype(np.uint8), volume)
    assert found[away < 28].all() and not found[away > 33].any()


def test_through_glasses_one_sees_the_room_and_a_bite_is_mended() -> None:
    """Two holes of the room's colour in a disc: Gaussians are in one of them alone."""
    y, x = np.mgrid[:96, :96]
    disc, glass, bite = np.hypot(x - 48, y - 48) < 40, np.hypot(x - 34, y - 48) < 9, np.hypot(x - 64, y - 48) < 3
    rough = np.where(disc & ~glass, np.where(np.hypot(x - 64, y - 48) < 6, 0.8, 1), 0).astype(np.float32)
    found = cut(skin(disc & ~glass & ~bite, 4), rough)
    assert found[bite].all()
    assert not found[glass].any()


def test_what_looks_like_the_room_is_doubted_in_noisy_pictures_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cut_out_module, "BAND", 8)
    rng, camera = np.random.default_rng(5), look_at_origin("c", 0, 0, 96)
    room, opacity = np.full((96, 96, 3), 0.7), np.ones((96, 96), np.float32)
    picture = np.full((96, 96, 3), 178.5) + rng.normal(0, 4, (96, 96, 3))
    picture[:, 48:] -= 20
    found = doubted(np.rint(picture).astype(np.uint8), opacity, room, camera)
    assert (found[:, :40] < INSIDE).mean() > 0.95
    assert found[:, 56:].min() == 1


def test_a_picture_that_is_all_subject_or_all_room_is_left_alone() -> None:
    image = np.zeros((16, 16, 3), np.uint8)
    assert cut(image, np.ones((16, 16), np.float32)).all()
    assert not cut(image, np.zeros((16, 16), np.float32)).any()


def test_hair_that_few_cameras_saw_is_known_by_its_colour_in_other_pictures() -> None:
    """Dark hair before a dark room: in one picture the Gaussians know a part of it, in another all."""
    rng, (y, x) = np.random.default_rng(2), np.mgrid[:96, :96]
    head, face = np.hypot(x - 48, y - 48) < 34, np.hypot(x - 48, y - 60) < 20
    image = np.where(head[..., None], (48, 34, 28), (14, 15, 16))
    image = (np.where(face[..., None], (190, 140, 110), image) + rng.integers(-4, 5, (96, 96, 3))).astype(np.uint8)
    whole = np.clip(0.5 + (34 - np.hypot(x - 48, y - 48)) / 6, 0, 1).astype(np.float32)
    part = np.where(face, 1, np.where(x < 48, 0.45 * whole, 0.55 * whole)).astype(np.float32)
    camera = look_at_origin("c", 0, 0, 96)

    def share(*starts: np.ndarray) -> float:
        colours = colours_of([(image, start, camera) for start in starts])
        return agreement(cut_out(image, part, camera, colours), head)

    assert share(part) < 0.8
    assert share(part, whole) > 0.9


def _before_a_plate(opacity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A skin-coloured thing before a noisy, tiled room: picture and plate."""
    rng, (y, x) = np.random.default_rng(0), np.mgrid[: opacity.shape[0], : opacity.shape[1]]
    room = np.where((x // 7 + y // 5)[..., None] % 2, (90, 140, 60), (40, 60, 120))
    image = opacity[..., None] * np.array((200, 150, 120)) + (1 - opacity[..., None]) * room
    noisy = [one + rng.integers(-3, 4, one.shape) for one in (image, room)]
    return noisy[0].astype(np.uint8), noisy[1].astype(np.uint8)


@pytest.mark.parametrize("size", [(64, 64), (63, 64), (64, 61), (63, 61)])
def test_beside_a_plate_opacity_is_found_along_the_outline(size: tuple[int, int]) -> None:
    """Also in pictures of odd sizes: OpenCV resizes more than four channels by whole factors only."""
    y, x = np.mgrid[: size[0], : size[1]]
    opacity = np.clip((20 - np.hypot(x - 32, y - 32)) / 4 + 0.5, 0, 1)
    found = from_plate(*_before_a_plate(opacity))
    assert np.abs(found - opacity).max() < 0.15  # seen: 0.07


def test_what_lies_farther_beside_a_plate_than_the_closed_form_looks_is_none() -> None:
    """A black square before a grey room that has a black thing beside it."""
    plate = np.full((40, 40, 3), 100, np.uint8)
    plate[12:16, 33:] = 0
    image = plate.copy()
    image[10:30, 10:30] = 0
    opacity = np.rint(255 * from_plate(image, plate)) / 255
    assert opacity[10:30, 10:30].min() > 0.99 and opacity[:, 33:].max() == 0


def _before_a_post() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Dark, streaked hair, fringed with single strands, before a bright wall with a post of the hair's colour."""
    rng, (y, x) = np.random.default_rng(0), np.mgrid[:96, :96]
    depth = 30 - np.hypot(x - 48, y - 48)
    opacity = np.where(depth > 0, 1.0, (depth > -6) * (rng.random(depth.shape) < 0.3))
    plate = np.where((abs(x - 20) < 5)[..., None], (45, 40, 38), (220, 210, 190)) + rng.integers(-2, 3, (96, 96, 3))
    colour = np.array((60, 48, 40)) + rng.integers(-20, 21, (96, 96, 1))
    image = opacity[..., None] * colour + (1 - opacity[..., None]) * plate + rng.integers(-2, 3, (96, 96, 3))
    return image.clip(0, 255).astype(np.uint8), plate.clip(0, 255).astype(np.uint8), opacity


def test_loose_hair_before_a_plate_is_strands_even_before_a_post_of_its_colour() -> None:
    image, plate, opacity = _before_a_post()
    found = from_plate(image, plate)
    assert agreement(found > 0.5, opacity > 0.5) > 0.97
    loose = (opacity < 1) & (np.hypot(*(np.mgrid[:96, :96] - 48)) < 36)
    assert abs(found[loose].mean() - opacity[loose].mean()) < 0.1  # on average it is right


def test_gaussians_say_where_hair_ends_before_a_shelf_of_its_colour() -> None:
    """But in a frame in which what they show has moved away, the plate alone."""
    rng, (y, x) = np.random.default_rng(0), np.mgrid[:96, :96]
    hair = np.clip(30.5 - np.hypot(x - 48, y - 48), 0, 1)
    colour = np.array((60, 48, 40)) + rng.integers(-6, 7, (96, 96, 1))
    plate = np.where((abs(y - 40) < 14)[..., None] & (x < 60)[..., None], (58, 50, 42), (220, 210, 190))
    image = hair[..., None] * colour + (1 - hair[..., None]) * plate
    chin = image.copy()
    chin[60:, 40:56] = plate[60:, 40:56]
    plate, image, chin = (np.rint(one + rng.normal(0, 1.5, one.shape)).astype(np.uint8) for one in (plate, image, chin))
    start = Expectation(hair.astype(np.float32), image)
    alone, found = (from_plate(image, plate, start=one) for one in (None, start))
    assert np.abs(alone - hair).mean() > 0.03  # hair that looks like the shelf is lost
    assert np.abs(found - hair).mean() < 0.01
    assert from_plate(chin, plate, start=start)[66:, 44:52].max() < 0.1


def test_a_thin_subject_before_a_plate_is_opaque_inside() -> None:
    opacity = np.zeros((64, 64))
    opacity[10:54, 30:35] = 1
    found = from_plate(*_before_a_plate(opacity))
    assert found[14:50, 31:34].min() > 0.9 and found[:, :26].max() < 0.1


def test_a_hand_of_another_colour_beside_a_body_is_opaque() -> None:
    """Its inside is its own: judged by the body's colours alone it would be half transparent."""
    image, plate = np.full((96, 96, 3), 235.0), np.full((96, 96, 3), 235.0)
    image[10:90, 8:60] = (50, 40, 35)
    image[30:80, 74:88] = (200, 150, 120)
    rng = np.random.default_rng(0)
    noisy = [(one + rng.normal(0, 2, one.shape)).clip(0, 255).astype(np.uint8) for one in (image, plate)]
    assert from_plate(noisy[0], noisy[1])[34:76, 76:86].min() > 0.9


def test_what_the_picture_cuts_off_is_opaque_up_to_its_border() -> None:
    image, plate = _before_a_plate(np.ones((64, 64)))
    image[:, :20], image[:, 44:], image[:20] = plate[:, :20], plate[:, 44:], plate[:20]
    image[40::4], image[41::4] = (230, 230, 230), (30, 30, 60)
    image[40:, :20], image[40:, 44:] = plate[40:, :20], plate[40:, 44:]
    assert from_plate(image, plate)[48:, 26:38].min() > 0.95


def test_shadows_and_holes_beside_a_plate_are_none() -> None:
    """A hole where the subject has the room's colour; a small thing that moved in the room."""
    y, x = np.mgrid[:64, :64]
    disc = np.hypot(x - 32, y - 32) < 20
    image, plate = _before_a_plate((disc & (np.hypot(x - 32, y - 32) > 4) | (np.hypot(x - 5, y - 5) < 3)).astype(float))
    assert agreement(from_plate(image, plate) > 0.5, disc) > 0.97
    assert not from_plate(*_before_a_plate(np.zeros((32, 32)))).any()  # nor is the empty room


def test_through_glasses_one_sees_the_plate_where_no_gaussians_are() -> None:
    """A hole of the plate's colour is filled, unless Gaussians have the same."""
    y, x = np.mgrid[:64, :64]
    disc, hole = np.hypot(x - 32, y - 32) < 26, np.hypot(x - 32, y - 32) < 10
    image, plate = _before_a_plate((disc & ~hole).astype(float))
    middle = np.hypot(x - 32, y - 32) < 5
    for opacity, found in ((None, 1.0), (disc, 1.0), (disc & ~hole, 0.0)):
        said = None if opacity is None else Expectation(opacity.astype(np.float32), image)
        np.testing.assert_allclose(from_plate(image, plate, start=said)[middle], found, atol=0.05)


def test_agreement_is_the_share_that_both_have_of_what_either_has() -> None:
    one, other = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    assert agreement(one, other) == 1
    one[:2], other[1:3] = True, True
    assert agreement(one, other) == pytest.approx(1 / 3)


def test_what_is_far_from_the_subject_changes_nothing() -> None:
    y, x = np.mgrid[:96, :96]
    disc = np.hypot(x - 30, y - 30) < 14
    image = skin(disc, 0)
    rough = np.clip(1.3 - np.hypot(x - 31, y - 30) / 18, 0, 1).astype(np.float32)
    found, image[80:, 80:] = cut(image, rough), (200, 150, 120)
    np.testing.assert_array_equal(cut(image, rough), found)
    assert around(disc, 3) == (slice(14, 47), slice(14, 47))


def test_opacity_ends_at_an_outline_before_a_wall_and_not_before_clutter() -> None:
    """Gaussians of a head reach beyond it by a haze, which the picture contradicts where the wall is known."""
    rng, (y, x) = np.random.default_rng(3), np.mgrid[:96, :96]
    away = np.hypot(x - 48, y - 48) - 30
    head, haze = away < 0, np.clip(0.6 - away / 12, 0, 1).astype(np.float32)
    wall = np.full((96, 96, 3), 0.06, np.float32)
    clutter = np.clip(wall + rng.normal(0, 0.2, wall.shape), 0, 1).astype(np.float32)
    camera = look_at_origin("c", 0, 0, 96)

    def beside(shown: np.ndarray) -> float:
        image = np.rint(255 * np.where(head[..., None], (0.7, 0.5, 0.4), shown)).astype(np.uint8)
        return float(softened(image, head, haze, wall, camera)[(away > 0.7) & (away < 1)].mean())

    assert 4 * beside(wall) < beside(clutter)


def test_an_outline_before_clutter_is_sharp_though_gaussians_are_a_haze() -> None:
    """And though what is said to stand behind is a guess: the picture's colours tell."""
    rng, (y, x) = np.random.default_rng(4), np.mgrid[:384, :384]
    away = np.hypot(x - 192, y - 192) - 100
    head, haze = np.clip(0.5 - away, 0, 1), np.clip(0.5 - away / 16, 0, 1).astype(np.float32)
    clutter = rng.integers(20, 236, (16, 16, 3)).repeat(24, 0).repeat(24, 1)
    clutter[..., 0] //= 2  # nothing in it looks like skin
    skin = np.array((215, 160, 130)) + rng.normal(0, 3, (384, 384, 3))
    image = np.clip(head[..., None] * skin + (1 - head[..., None]) * clutter, 0, 255).astype(np.uint8)
    behind = np.full((384, 384, 3), 0.4, np.float32)
    opacity = softened(image, head > 0.5, haze, behind, look_at_origin("c", 0, 0, 384))
    assert np.abs(opacity - head)[np.abs(away) < 4].mean() < 0.05


def test_between_locks_one_sees_what_stands_behind() -> None:
    """A silhouette is filled; its comb of hair is not, where the picture shows the wall."""
    y, x = np.mgrid[:384, :384]
    head, comb = np.hypot(x - 192, y - 192) < 100, (abs(y - 192) < 40) & (x > 270) & (x < 330)
    locks = comb & (y % 8 < 4) & ~head
    cut = head | comb
    image = np.full((384, 384, 3), 15, np.uint8)
    image[head | locks] = (60, 45, 38)
    behind = np.full((384, 384, 3), 15 / 255, np.float32)
    start = np.where(head, 1, np.where(comb, 0.5, 0)).astype(np.float32)
    opacity = softened(image, cut, start, behind, look_at_origin("c", 0, 0, 384))
    beside = comb & (x > 321) & (x < 328) & (abs(y - 192) < 30)
    assert opacity[beside & ~locks].mean() < 0.6 * opacity[beside & locks].mean()
    assert opacity[head & (x < 180) & (np.hypot(x - 192, y - 192) < 60)].min() == 1


def test_what_is_guessed_to_stand_behind_takes_nothing_away() -> None:
    """Hidden from all cameras, hair is said to stand behind hair: beside it one sees that the wall is another."""
    y, x = np.mgrid[:384, :384]
    head = np.hypot(x - 192, y - 192) < 100
    image, behind = np.full((384, 384, 3), 190, np.uint8), np.full((384, 384, 3), 190 / 255, np.float32)
    image[head], behind[np.hypot(x - 192, y - 192) < 104] = (60, 45, 38), np.array((60, 45, 38)) / 255
    opacity = softened(image, head, head.astype(np.float32), behind, look_at_origin("c", 0, 0, 384))
    assert opacity[np.hypot(x - 192, y - 192) < 95].min() > 0.999
    assert opacity[head].mean() > 0.97


@pytest.mark.parametrize("all_of_it", [True, False])
def test_a_silhouette_of_nothing_or_of_the_whole_picture_stays(all_of_it: bool) -> None:
    image, cut = np.full((24, 24, 3), 80, np.uint8), np.full((24, 24), all_of_it)
    start, behind = np.full((24, 24), 0.5, np.float32), np.zeros((24, 24, 3), np.float32)
    opacity = softened(image, cut, start, behind, look_at_origin("c", 0, 0, 24))
    np.testing.assert_array_equal(opacity, cut)
