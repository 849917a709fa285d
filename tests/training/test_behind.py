"""What stands behind the subject, as far as pictures show it beside."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.training.explicit.behind import covered, fill, filled_in


def test_a_plain_room_is_drawn_on() -> None:
    image = np.full((37, 50, 3), (0.2, 0.4, 0.6), np.float32)
    known = np.ones((37, 50), bool)
    image[8:30, 10:40], known[8:30, 10:40] = 0.9, False
    assert np.allclose(fill(image, known), (0.2, 0.4, 0.6), atol=1e-5)


def test_what_is_known_stays_and_a_gradient_goes_on_smoothly() -> None:
    x = np.linspace(0, 1, 64, dtype=np.float32)
    image = np.broadcast_to(x[None, :, None], (64, 64, 3)).copy()
    known = np.ones((64, 64), bool)
    known[24:40, 24:40] = False
    filled = fill(np.where(known[..., None], image, 0), known)
    assert np.array_equal(filled[known], image[known])
    assert np.abs(filled - image).max() < 0.15 and np.abs(filled[32, 32] - image[32, 32]).max() < 0.02


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2, 3), (5, 1)])
def test_any_size_and_nothing_known(size: tuple[int, int]) -> None:
    image = np.ones((*size, 3), np.float32)
    assert np.array_equal(fill(image, np.zeros(size, bool)), np.zeros_like(image))
    assert np.array_equal(fill(image, np.ones(size, bool)), image)


def test_a_single_known_pixel_fills_all() -> None:
    image, known = np.zeros((16, 16, 3), np.float32), np.zeros((16, 16), bool)
    image[3, 4], known[3, 4] = 0.5, True
    assert np.allclose(fill(image, known), 0.5, atol=1e-4)


def test_pixels_between_rays_are_covered_too() -> None:
    """Every third pixel of a picture is known; those of rows 8 to 11 and columns 6 to 17 are opaque."""
    pixel = np.arange(1, 24 * 20, 3)
    row, column = pixel // 24, pixel % 24
    opaque = (row >= 8) & (row < 12) & (column >= 6) & (column < 18)
    near = covered(pixel, opaque, (20, 24))
    assert near[8:12, 6:18].all() and near[6, 10] and not near[5].any() and not near[:, 2].any()
    assert not covered(pixel, np.zeros(len(pixel), bool), (20, 24)).any()
    assert not covered(np.zeros(0, np.int64), np.zeros(0, bool), (4, 4)).any()


def test_cameras_are_filled_apart() -> None:
    pictures = np.stack([np.full((100, 3), 51, np.uint8), np.full((100, 3), 204, np.uint8)])
    pictures[:, 44:46] = 255
    camera, pixel = np.repeat([0, 1], 100), np.tile(np.arange(100), 2)
    filled = filled_in(pictures, camera, pixel, np.isin(pixel, (44, 45)), (10, 10))
    assert filled.shape == (2, 100, 3)
    assert np.allclose(filled[0], 0.2) and np.allclose(filled[1], 0.8)


def test_what_no_ray_reaches_is_not_taken_for_the_room() -> None:
    """A room of 0.2; below row 8, where rays end, the subject of 0.8 goes on."""
    row, column = np.divmod(np.arange(200), 10)
    picture = np.where((row >= 12) | ((row >= 4) & (column > 2) & (column < 7)), 204, 51).astype(np.uint8)
    pixel = np.flatnonzero(row < 12)
    opaque = picture[pixel] == 204
    filled = filled_in(picture[None, :, None].repeat(3, 2), pixel * 0, pixel, opaque, (20, 10))
    assert np.allclose(filled, 0.2)


def test_before_a_picture_that_is_covered_nothing_is_known() -> None:
    pixel = np.arange(100)
    filled = filled_in(np.zeros((1, 100, 3), np.uint8), pixel * 0, pixel, np.ones(100, bool), (10, 10))
    assert np.isinf(filled).all()
