"""The conversion between RGB and the video's planes, before any codec."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.ndimage

from facefolds_core.asset.colour import alpha_to_luma, luma_to_alpha, rgb_to_yuv420, yuv420_to_rgb


def uniform(rgb: tuple[int, int, int]) -> np.ndarray:
    return np.full((4, 4, 3), rgb, np.uint8)


@pytest.mark.parametrize(
    ("rgb", "yuv"),
    [
        # ITU-R BT.709-6, item 3.5: black, white and the three primaries in 8 bits.
        ((0, 0, 0), (16, 128, 128)),
        ((255, 255, 255), (235, 128, 128)),
        ((255, 0, 0), (63, 102, 240)),
        ((0, 255, 0), (173, 42, 26)),
        ((0, 0, 255), (32, 240, 118)),
    ],
)
def test_known_codes(rgb: tuple[int, int, int], yuv: tuple[int, int, int]) -> None:
    assert tuple(int(plane[1, 1]) for plane in rgb_to_yuv420(uniform(rgb))) == yuv


def test_uniform_colours_come_back() -> None:
    for rgb in np.random.default_rng(0).integers(0, 256, (300, 3)):
        image = uniform(tuple(rgb))
        error = np.abs(yuv420_to_rgb(*rgb_to_yuv420(image)).astype(int) - image)
        assert error.max() <= 3  # half a code of chroma times 1.8556 * 255 / 224, and half a code of luma; 2 seen


def test_chroma_is_read_by_a_linear_look_up_as_graphics_cards_do_it() -> None:
    # OpenGL's GL_LINEAR with GL_CLAMP_TO_EDGE in a plane of half the size, at luma's own coordinate.
    cr = np.random.default_rng(0).integers(100, 156, (8, 12)).astype(np.uint8)
    at = [np.clip((np.arange(2 * size) + 0.5) / 2 - 0.5, 0, size - 1) for size in cr.shape]
    expected = scipy.ndimage.map_coordinates(cr.astype(float), np.meshgrid(*at, indexing="ij"), order=1)
    grey, neutral = np.full((16, 24), 126, np.uint8), np.full(cr.shape, 128, np.uint8)
    red = 255 * ((126 - 16) / 219 + 1.5748 * (expected - 128) / 224)
    assert np.abs(yuv420_to_rgb(grey, neutral, cr)[..., 0] - red).max() <= 0.51


@pytest.mark.parametrize("height", [2, 4, 12])
def test_no_other_chroma_comes_back_nearer(height: int) -> None:
    """Least squares: what is left over is at right angles to all that could be written."""
    red = np.random.default_rng(0).integers(120, 136, (height, 10))
    image = np.stack([red, np.full(red.shape, 128), np.full(red.shape, 128)], -1).astype(np.uint8)
    luma = 0.2126 * red / 255 + 0.7874 * 128 / 255
    wanted = (red / 255 - luma) / 1.5748 * 224
    rows, columns = (interpolation(size) for size in wanted.shape)
    best = np.linalg.pinv(rows) @ wanted @ np.linalg.pinv(columns).T
    assert np.abs(rgb_to_yuv420(image)[2].astype(float) - 128 - best).max() <= 0.501


def interpolation(size: int) -> np.ndarray:
    """(size, size / 2): linear look-ups of centred samples, clamped."""
    at = np.clip((np.arange(size) + 0.5) / 2 - 0.5, 0, size // 2 - 1)
    return np.maximum(0, 1 - np.abs(at[:, None] - np.arange(size // 2)))


def test_chroma_that_would_overshoot_stays_within_its_codes() -> None:
    image = np.zeros((8, 8, 3), np.uint8)
    image[:, 3:] = (255, 0, 0)
    assert rgb_to_yuv420(image)[2].max() <= 240  # unbounded it would be 259


def test_alpha_is_at_most_one_off_and_exact_at_the_ends() -> None:
    alpha = np.arange(256, dtype=np.uint8)[None]
    back = luma_to_alpha(alpha_to_luma(alpha))
    assert np.abs(back.astype(int) - alpha).max() <= 1
    assert back[0, 0] == 0 and back[0, 255] == 255


def test_luma_beyond_its_range_is_clipped() -> None:
    np.testing.assert_array_equal(luma_to_alpha(np.array([[0, 15, 236, 255]], np.uint8)), [[0, 0, 255, 255]])


def test_alpha_is_the_red_that_a_browser_sees() -> None:
    # Every luma code with neutral chroma, converted as a picture: R is alpha.
    luma = np.repeat(np.arange(256, dtype=np.uint8), 2)[None].repeat(2, 0)
    neutral = np.full((1, 256), 128, np.uint8)
    red = yuv420_to_rgb(luma, neutral, neutral)[..., 0].astype(int)
    assert np.abs(red - luma_to_alpha(luma)).max() <= 1
